"""What a fit says before its end: how many evaluations, the best so far, and that alone where it is stopped."""

import re
from concurrent.futures import CancelledError

import numpy as np
import pytest
from tests.small_robots import DRIVEN

from nectosome.description import parse_robot
from nectosome.description.variables import read_variable
from nectosome.identification import FitSoFar, FitStoppedError
from nectosome.identification.robot.fit import fit_robot
from nectosome.identification.robot.trials import read_compared, robot_trials
from nectosome.model import build

from .test_robot_fit import NOISE, TIME, C, K, angle, recording


@pytest.fixture(scope="module")
def fitted():
    """A fit of a recording of a hinge, given what is to watch it, and what was measured."""
    description = parse_robot(DRIVEN)
    variables = [
        read_variable("k", "0.5 N m/rad .. 1.2 N m/rad log", description),
        read_variable("c", "0.01 N m s/rad .. 0.1 N m s/rad log", description),
    ]
    compared = [read_compared("encoder", "body.angle", build(description))]
    measured = angle(K, C) + NOISE * np.random.default_rng(1).normal(size=TIME.size)
    trials = robot_trials([recording(measured)], description, compared, {})
    return lambda progress: fit_robot(description, variables, trials, compared, {}, progress=progress), measured


def test_a_fit_that_is_stopped_has_the_best_so_far_and_what_that_leaves(fitted):
    """By the closed form of the motion with these values."""
    (fit, measured), said = fitted, []

    def progress(words, share):
        said.append(words)
        return words.count("; best so far ") == 0

    with pytest.raises(FitStoppedError) as stopped:
        fit(progress)
    best = stopped.value.best
    assert re.match(r"fitting, evaluation \d+ of about \d+; best so far k = ", said[-1])
    assert said[-1].endswith(best.words)
    assert best.values.keys() == {"k", "c"} == best.shown.keys()
    left = angle(best.values["k"], best.values["c"]) - measured
    off = 100 * np.sqrt(np.mean(left**2)) / np.ptp(measured)
    assert best.off["encoder"] == pytest.approx(off, rel=5e-3)  # motions are computed to 1e-5
    assert best.recordings == (1, 1)


def test_a_fit_that_is_stopped_before_its_first_step_has_no_best(fitted):
    (fit, _), seen = fitted, []
    with pytest.raises(FitStoppedError) as stopped:
        fit(lambda words, share: seen.append(words) or len(seen) < 2)
    assert isinstance(stopped.value, CancelledError)
    assert stopped.value.best is None
    assert seen == ["fitting", "fitting, evaluation 1 of about 40"]


def test_the_best_so_far_gets_better_and_ends_at_what_is_found(fitted):
    (fit, _), said = fitted, []
    found = fit(lambda words, share: said.append(words))
    off = [float(one[1]) for words in said if (one := re.search(r"encoder off by ([0-9.e+-]+) %", words))]
    assert off == sorted(off, reverse=True)
    assert len(set(off)) > 1
    assert off[-1] == pytest.approx(float(found.to_dataset()["e_rmsp"][0, 0]), rel=1e-2)


def test_before_its_first_step_a_fit_has_no_best(fitted):
    with pytest.raises(FitStoppedError) as stopped:
        fitted[0](lambda words, share: False)
    assert stopped.value.best is None


def test_errors_of_a_few_recordings_are_told_to_be_of_these():
    best = FitSoFar({"k": 0.75}, {"k": "0.75 N m/rad"}, {"encoder": 1.234, "push": 20.0}, (4, 12))
    assert best.words == "k = 0.75 N m/rad; encoder off by 1.23 %, push off by 20 % of its range in 4 of 12 recordings"

"""The numbers of a cycle over the last whole beats of a run: against closed forms, and against the cycle itself."""

import jax
import numpy as np
import pytest
from tests.solve.test_stroke import FIN, LENGTH, A, F, V, towed

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import cycle_means, periodic, simulate
from nectosome.solve.beat_means import beat_means
from nectosome.solve.results import diagnose_all

diagnosed = jax.jit(diagnose_all)
# beats on its way to a speed, lighter, so that it comes to a cycle
SWIMMER = FIN.replace("mass: 2 kg", "mass: 0.5 kg")


@pytest.fixture(scope="module")
def fin():
    return build(parse_robot(FIN))


def over(robot, beats: float, samples: int, text: str = FIN):
    """Means of beats of a run that is towed for so many of them."""
    times, states = towed(robot, 0.7, n=samples)
    times, states = times * beats, jax.tree.map(lambda x: x, states)
    place = states.q.at[:, :2].set(states.q[:1, :2] + times[:, None] * states.v[:1, :2])
    states = type(states)(place, states.v, states.z)
    return beat_means(robot, np.asarray(times), diagnosed(robot, times, states), {"robot": text})


def test_the_last_beats_tell_a_stroke_wherever_samples_fall(fin):
    """Of 23.3 beats the last 2, with 60.4 samples each, straight between: 1 - cos(pi/60) of an amplitude at most."""
    found = {name: float(values) for name, (_, values, _) in over(fin, 23.3, 1409).items()}
    assert found["tail_amplitude"] == pytest.approx(LENGTH * np.sin(A), rel=1.4e-3)
    assert found["strouhal"] == pytest.approx(2 * F * LENGTH * np.sin(A) / V, rel=1.4e-3)
    assert found["body_lengths_per_second"] == pytest.approx(V / 0.5, rel=1e-9)
    assert found["stride_length"] == pytest.approx(V / (0.5 * F), rel=1e-9)  # of one beat, not of two
    cycle = jax.jit(cycle_means)(fin, *towed(fin, 0.7))
    for name in ("power", "power_positive", "froude_efficiency", "cost_of_transport", "energy_per_metre_positive"):
        assert found[name] == pytest.approx(float(getattr(cycle, name)), rel=5e-3), name
    assert np.isnan(found["endurance"]) and np.isnan(found["cost_of_transport_battery"])


@pytest.mark.parametrize(
    ("beats", "samples", "ramp"),
    [(2.9, 1409, "0 s"), (23.3, 300, "0 s"), (23.3, 1409, "16.4 s")],  # 23.3 beats are 18.64 s
)
def test_too_few_beats_or_samples_tell_none(fin, beats, samples, ramp):
    assert over(fin, beats, samples, FIN.replace("frequency:", f"ramp: {ramp}, frequency:")) == {}


def test_after_a_ramp_come_beats_that_tell(fin):
    assert over(fin, 23.3, 1409, FIN.replace("frequency:", "ramp: 16.2 s, frequency:"))


def test_a_run_from_the_cycle_has_the_numbers_of_the_cycle():
    robot = build(parse_robot(SWIMMER))
    cycle = periodic(robot)
    found, wanted = simulate(robot, 3 / F, samples=301, rtol=1e-6, initial=cycle.state).results().data, cycle.means()
    for name in ("speed", "stride_length", "tail_amplitude", "strouhal", "power", "cost_of_transport"):
        assert float(found[name][1]) == pytest.approx(float(getattr(wanted, name)), rel=3e-3), name

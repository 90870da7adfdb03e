"""The front between two objectives."""

from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from nectosome.search import Nsga2, front, multistart
from nectosome.units import InputError

from .tasks import Known

pytest.importorskip("pymoo")
HERE = ThreadPoolExecutor(1)


@pytest.mark.parametrize("holes", [(), ((0.5, 0.4, 0.3),)])
def test_the_front_between_two_circles_is_the_line_between_their_centres(holes):
    """sqrt(f1) + sqrt(f2) = 1 there; polished designs are exact."""
    optimiser = Nsga2(0, population=20, evaluations=200, polish=8)
    result = multistart(Known("circles", holes=holes), optimiser, 2, executor=HERE)
    evaluations = [e for start in result.starts for e in start.evaluations]
    members = front(evaluations, 0)
    off = np.array([np.sqrt(e.objective) + np.sqrt(e.constraints[0] + 1) - 1 for e in members])
    polished = np.array([e.gradient is not None for e in members])
    assert off.max() < 0.1
    assert np.sum(polished & (off < 1e-5)) >= 8
    assert all(np.isnan(e.objective) for e in evaluations if not e.solved)
    f = np.array([[e.objective, e.constraints[0]] for e in members])
    assert np.all(np.diff(f[:, 0]) > 0)
    assert np.all(np.diff(f[:, 1]) < 0)
    again = multistart(Known("circles", holes=holes), optimiser, 2, workers=2)
    assert [e.u.tobytes() for start in again.starts for e in start.evaluations] == [e.u.tobytes() for e in evaluations]


def test_bad_options_are_told():
    for options, message in (
        ({"versus": -1}, "versus: is -1"),
        ({"versus": 0, "population": 1}, "population: is 1"),
        ({"versus": 0, "evaluations": 0}, "evaluations: is 0"),
        ({"versus": 0, "polish": -1}, "polish: is -1"),
        ({"polish": 3}, "polish: needs versus"),
    ):
        with pytest.raises(InputError, match=message):
            Nsga2(**options)
    for optimiser, message in ((Nsga2(3), "versus: is 3; the task has 1 constraints"), (Nsga2(), "versus: is needed")):
        with pytest.raises(InputError, match=message):
            multistart(Known("circles"), optimiser, 1, executor=HERE)

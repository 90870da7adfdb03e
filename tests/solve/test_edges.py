"""Robots at the edges of what a file may say: a motion whose powers balance, or an honest reason."""

import pytest
from benchmarks.edges import EDGES, answer, rod

from nectosome.core import Status
from nectosome.description import parse_robot
from nectosome.solve import static

QUICK = (
    "bending of order 20 with 10 points",
    "half way into a contact",
    "beyond a stop",
    "0.1 kg/m3",
    "100 m",
    "1e200 N/m",
    "1e-200 Pa at rest",
)


@pytest.mark.parametrize(
    "name", [name if name in QUICK else pytest.param(name, marks=pytest.mark.slow) for name in EDGES]
)
def test_what_comes_is_a_motion_or_a_reason(name: str):
    edge = EDGES[name]
    found = answer(edge)
    if isinstance(edge.status, str):
        assert isinstance(found.status, str) and found.status.startswith(edge.status)
        assert "Give the rod at least" in found.status
        return
    assert found.status == edge.status
    if found.status == Status.SOLVED:
        assert found.finite
        assert found.unbalanced < 1e-9


@pytest.mark.parametrize(("length", "radius"), [(1e-6, 50e-9), (0.5, 0.05), (100.0, 0.1)])
def test_a_rod_of_any_size_sags_as_a_beam_does(length: float, radius: float):
    """w L^4 / (8 E I) of a cantilever 100 kg/m3 heavier than water, with the modulus that makes it a millionth of L."""
    young = 100.0 * 9.80665 * length**3 / (2 * 1e-6 * radius**2)
    found = static(parse_robot(rod(length=f"{length} m", radius=f"{radius} m", young=f"{young} Pa", loads="")))
    assert int(found.status) == Status.SOLVED
    tip = found.to_dataset().position.values.reshape(-1, 3)[-1, 2]
    assert tip == pytest.approx(-1e-6 * length, rel=1e-6)

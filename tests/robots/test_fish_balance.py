"""The fish as it swims freely: forces and powers balance on the mean, and a biased beat turns it."""

import numpy as np
import pytest

from nectosome.designs import sweep

BIAS = [-1e4, 0.0, 1e4]  # Pa, on the left chamber
pytestmark = pytest.mark.slow
COARSE = ["limbs.tail.strains={bending_z: 1}", "limbs.tail.points=5", "f=2Hz", "p=0.4bar"]


@pytest.fixture(scope="module")
def swum():
    found = sweep("fish", {"bias": BIAS}, COARSE, samples=129)
    assert set(found["status"].values) == {"SOLVED"}
    return found


def test_the_wake_pushes_as_the_water_drags(swum):
    """Towards -x, and no force is left on the mean."""
    push = swum["load_force"].sel(bias=0, axis="x", load="wake").sum("part")
    drag = swum["load_force"].sel(bias=0, axis="x", load="drag").sum("part")
    assert float(push) < 0
    assert float(drag) == pytest.approx(-float(push), rel=1e-3)


def test_what_the_chambers_give_is_what_water_and_silicone_take(swum):
    given = swum["load_power"].sel(load=["left", "right"]).sum(("load", "part"))
    taken = swum["load_power"].sel(load=["drag", "wake", "viscous"]).sum(("load", "part"))
    np.testing.assert_allclose(swum["power"], given, rtol=1e-12)
    np.testing.assert_allclose(-taken, given, rtol=1e-4)


def test_a_bias_turns_it_to_either_side_alike(swum):
    turn, speed = swum["turn_rate"], swum["speed"]
    assert abs(float(turn.sel(bias=0))) < 1e-3 * float(turn.sel(bias=1e4))
    assert float(turn.sel(bias=-1e4)) == pytest.approx(-float(turn.sel(bias=1e4)), rel=1e-3)
    assert float(speed.sel(bias=-1e4)) == pytest.approx(float(speed.sel(bias=1e4)), rel=1e-4)

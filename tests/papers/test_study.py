"""How numbers are scored, and the parts of the flagellum study that need no search."""

import numpy as np
import pytest

from nectosome.io import apply_settings
from nectosome.papers.flagellum.pool import NO_LOAD, STALL, on_motor_line, reaction_over_a_turn
from nectosome.papers.study import printed, score
from nectosome.robots import build, describe
from nectosome.solve import steady

ENTRY = {"quantity": "speed", "unit": "m/s", "printed": 2.0, "tolerance": 1.0}


@pytest.mark.parametrize(
    ("entry", "ours", "verdict"),
    [
        (ENTRY, 2.01, "match"),
        (ENTRY, 2.1, "differs"),
        (ENTRY | {"better": "high"}, 2.1, "better"),
        (ENTRY | {"better": "high"}, 1.9, "differs"),
        (ENTRY | {"better": "low"}, 1.9, "better"),
        (ENTRY | {"printed": 0.0, "within": 1e-9}, 1e-10, "match"),
        (ENTRY | {"printed": 0.0, "within": 1e-9}, -1e-8, "differs"),
        ({"quantity": "speed", "unit": "m/s", "direction": -1}, -0.1, "match"),
        ({"quantity": "speed", "unit": "m/s", "direction": -1}, 0.1, "differs"),
        ({"quantity": "speed", "unit": "m/s"}, 0.1, "not reproducible"),
    ],
)
def test_verdicts(entry, ours, verdict):
    row = score("a/row", entry, ours)
    assert row["verdict"] == verdict
    assert row["ours"] == ours
    if entry.get("printed"):
        assert row["error"] == pytest.approx(100 * (ours - entry["printed"]) / entry["printed"])
    else:
        assert row["error"] is None


def test_every_entry_says_what_it_is_and_how_it_is_judged():
    for row, entry in printed("flagellum").items():
        assert entry["quantity"] and entry["unit"], row
        if entry.get("printed") == 0:
            assert entry["within"] > 0, row
        elif "printed" in entry:
            assert entry["tolerance"] >= 0, row


def test_a_motor_on_its_line_gives_what_the_propeller_takes():
    description = apply_settings(describe("flagellum"), ["omega=14.4rad/s"])
    swim = on_motor_line(description)
    assert swim.torque == pytest.approx(STALL * (1 - swim.rate / NO_LOAD), rel=1e-4)
    slower = on_motor_line(description, 0.1)
    assert slower.speed < 0.5 * swim.speed


def test_over_a_turn_only_thrust_and_axial_torque_remain():
    """And they are what the hull's drag and the motor balance."""
    robot = build(describe("flagellum"))
    found = steady(robot)
    wrench = reaction_over_a_turn(robot, found.state, ("shaft", "hook", "filament"))["wrench"]
    mean = wrench.mean("angle").values
    speed = -float(found.state.v[0])
    hull = 500 * 0.012566370614359173 * speed**2
    np.testing.assert_allclose(mean[[1, 2, 4, 5]], 0, atol=1e-12)
    assert mean[3] == pytest.approx(-hull, rel=1e-9)
    assert mean[0] == pytest.approx(-float(found.to_dataset()["reaction"][0, 0]), rel=1e-9)
    assert np.max(np.abs(wrench.values[:, 4])) > 1  # at each moment there is a lateral force

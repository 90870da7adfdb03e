"""How numbers are scored, and the parts of the flagellum study that need no search."""

import numpy as np
import pytest

from nectosome.description import get_value, with_values
from nectosome.model import build
from nectosome.robots import describe
from nectosome_studies import STUDIES
from nectosome_studies.flagellum.optimum import MOTOR, ON_BATTERY
from nectosome_studies.flagellum.prototype import on_motor_line
from nectosome_studies.flagellum.steady_swims import Swimmer, lateral_share, reaction_over_a_turn
from nectosome_studies.study import KINDS, printed, score

BARE = {"quantity": "speed", "unit": "m/s", "kind": "prediction"}
ENTRY = BARE | {"source": "measured", "printed": 2.0, "tolerance": 1.0}
COMPUTED = ENTRY | {"source": "computed"}
RANGE = BARE | {"source": "computed", "printed": [0.2, 0.5]}


@pytest.mark.parametrize(
    ("entry", "ours", "verdict"),
    [
        (ENTRY, 2.01, "match"),
        (ENTRY, 2.1, "differs"),
        (COMPUTED | {"better": "high"}, 2.1, "better"),
        (COMPUTED | {"better": "high"}, 1.9, "differs"),
        (COMPUTED | {"better": "low"}, 1.9, "better"),
        (ENTRY | {"at_most": True}, 0.5, "match"),
        (ENTRY | {"at_most": True}, 2.1, "differs"),
        (ENTRY | {"printed": 0.0, "within": 1e-9}, 1e-10, "match"),
        (ENTRY | {"printed": 0.0, "within": 1e-9}, -1e-8, "differs"),
        (BARE | {"source": "measured", "direction": -1}, -0.1, "match"),
        (BARE | {"source": "measured", "direction": -1}, 0.1, "differs"),
        (ENTRY | {"kind": "identification"}, 2.01, "match"),
        *((ENTRY | {"kind": kind}, 2.01, "") for kind in KINDS if kind not in ("prediction", "identification")),
        (BARE, 0.1, ""),
        (ENTRY, None, ""),
        (RANGE, 0.2, "match"),
        (RANGE, 0.5, "match"),
        (RANGE, 0.19, "differs"),
        (RANGE, 0.51, "differs"),
        (RANGE | {"printed": [-0.1, 0.0]}, 0.01, "differs"),
        (RANGE | {"kind": "calibration"}, 0.3, ""),
    ],
)
def test_verdicts(entry, ours, verdict):
    row = score("a/row", entry, ours)
    assert row["verdict"] == verdict
    assert row["ours"] == ours
    if isinstance(entry.get("printed"), list):
        return
    if entry.get("printed") and ours is not None:
        assert row["error"] == pytest.approx(100 * (ours - entry["printed"]) / entry["printed"])
    else:
        assert row["error"] is None


@pytest.mark.parametrize(
    ("printed", "ours", "error"),
    [
        ([0.2, 0.5], 0.3, 0.0),
        ([0.2, 0.5], 0.1, -50.0),
        ([0.2, 0.5], 0.6, 20.0),
        ([-0.5, -0.2], -0.1, 50.0),
        ([0.0, 0.5], -0.1, None),  # of zero there is no percentage
        ([0.2, 0.5], None, None),
    ],
)
def test_the_error_of_a_printed_range_is_that_of_its_nearest_end(printed, ours, error):
    row = score("a/row", RANGE | {"printed": printed}, ours)
    assert row["printed"] == printed
    assert row["error"] == pytest.approx(error)


def test_people_read_a_row_in_a_unit_of_its_own():
    """Its numbers stay in the row's unit."""
    row = score("a/row", ENTRY | {"shown": "cm/s"}, 2.01)
    assert (row["ours"], row["printed"], row["unit"], row["shown"]) == (2.01, 2.0, "m/s", "cm/s")
    assert score("a/row", ENTRY, 2.01)["shown"] == "m/s"
    with pytest.raises(RuntimeError, match="m/s cannot be shown in cm"):
        score("a/row", ENTRY | {"shown": "cm"}, 2.01)


@pytest.mark.parametrize(
    "entry",
    [
        {key: value for key, value in ENTRY.items() if key != "source"},
        ENTRY | {"kind": "synthetic"},
        ENTRY | {"source": "printed"},
        ENTRY | {"better": "low"},  # than a measured number nothing simulated is better
        BARE | {"source": "measured"},
    ],
)
def test_a_row_without_its_kind_or_its_source_is_none(entry):
    with pytest.raises(RuntimeError, match="scorecard row a/row"):
        score("a/row", entry, 1.0)


@pytest.mark.parametrize("study", [name for name in STUDIES if name not in ("gallery", "vortex")])
def test_every_entry_says_what_it_is_and_how_it_is_judged(study):
    """And has no tolerance where there is no verdict."""
    for row, entry in printed(study).items():
        assert entry["quantity"] and entry["unit"], row
        assert score(row, entry, None)["kind"] == entry["kind"]
        judged = entry["kind"] in ("prediction", "identification") and "printed" in entry
        judged = judged and not isinstance(entry["printed"], list)  # a range is its own tolerance
        assert ("tolerance" in entry or "within" in entry) == judged, row
        if judged:
            assert entry["within"] > 0 if entry["printed"] == 0 else entry["tolerance"] >= 0, row


@pytest.mark.slow
def test_a_motor_on_its_line_gives_what_the_propeller_takes():
    description = describe("flagellum")
    rate, swim = on_motor_line(description)
    assert swim.torque == pytest.approx(MOTOR.stall * (1 - rate / MOTOR.no_load), rel=1e-4)
    assert on_motor_line(description, 0.1)[1].speed < 0.5 * swim.speed


def test_on_the_battery_the_motor_drives_the_printed_optimum_and_one_that_is_a_hundredth_faster():
    """The latter as the search finds it, to four digits; the design for 0.5 N m at 22 rad/s is beyond both lines."""
    description = describe("flagellum")
    faster = with_values(description, {"L": 0.7, "tip_radius": 7.785e-3, "alpha": 0.8076, "E": 4.822e6})
    rate, swim = on_motor_line(faster, motor=ON_BATTERY)
    printed = on_motor_line(description, motor=ON_BATTERY)[1].speed
    assert (rate, swim.speed, printed) == pytest.approx((14.797, 0.69707, 0.68981), rel=1e-3)
    most = {"torque": 0.5, "drive_rate": 22.0}
    assert MOTOR.excess(most) == pytest.approx(0.5 / 0.89) and ON_BATTERY.excess(most) > 0.2


def test_over_a_turn_only_thrust_and_axial_torque_remain():
    """And they are what the hull's drag and the motor balance."""
    description = describe("flagellum")
    swim = Swimmer(description).swim()
    rate = float(get_value(description, "omega"))
    turn = reaction_over_a_turn(build(description), swim.state, rate, ("shaft", "hook", "filament"))
    mean = turn["wrench"].mean("time").values
    hull = 500 * float(get_value(description, "body.loads.hull_drag.drag_area.0")) * swim.speed**2
    assert mean[3] == pytest.approx(-hull, rel=1e-6)
    assert mean[0] == pytest.approx(-swim.torque, rel=1e-6)
    assert lateral_share(turn) < 1e-6
    assert np.max(np.abs(turn["wrench"].values[:, 4])) > 1  # at each moment there is a lateral force

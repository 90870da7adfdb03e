"""`periodic` on motors that find their own period: what it prints and saves, and what it says where there is none."""

from pathlib import Path

from tests.small_robots import WHEEL, turning

from nectosome.core import Status
from nectosome.io import load_dataset
from nectosome.solve import periodic


def test_the_period_of_a_motors_turns_is_found_told_and_saved(nectosome):
    Path("wheel.yaml").write_text(WHEEL)
    done = nectosome("periodic", "wheel.yaml", "--save", "turn.nc")
    assert (done.code, done.err) == (0, "")
    saved, found = load_dataset("turn.nc"), periodic("wheel.yaml")
    assert saved.attrs["period"] == saved["time"].values[-1] == found.stats["period"]
    assert f"wheel: periodic motion, period {1e3 * saved.attrs['period']:.4g} ms" in done.out
    shown = nectosome("show", "turn.nc")
    assert (shown.code, shown.err) == (0, "")


def test_a_motor_that_stalls_and_a_period_that_is_not_its_own_are_told(nectosome):
    Path("wheel.yaml").write_text(WHEEL)
    done = nectosome("periodic", "wheel.yaml", "--set", "U=0 V")
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith(f"wheel: {Status.NO_TURN.reason}. Give it more voltage")
    done = nectosome("periodic", "wheel.yaml", "--period", "0.3 s")
    assert (done.code, done.out) == (1, "")
    assert "The motor of body.angle finds its own speed, and the period with it: leave --period out." in done.err


def test_a_motor_that_can_turn_nothing_round_is_told_with_its_place(nectosome):
    Path("wheel.yaml").write_text(WHEEL.replace("axis: y,", "axis: y, stiffness: 0.1 N m/rad,"))
    done = nectosome("periodic", "wheel.yaml")
    assert done.code == 2
    assert done.err.startswith("wheel.yaml, body.joint.motor: a motor finds its own speed")


BOB = "kind: rigid, shape: point, mass: 0.1 kg, volume: 0 m3, centre_of_mass: [20 mm, 0 mm, 0 mm]"
TWO = f"""
name: wheels
water: {{gravity: 9.81 m/s2}}
body: {{kind: rigid, shape: point, mass: 1 kg, joint: {{kind: fixed}}}}
limbs:
  first: {{{BOB}, joint: {{kind: revolute, axis: y, {turning("1 V")}}}}}
  second: {{{BOB}, joint: {{kind: revolute, axis: y, {turning("1.3 V")}}}}}
"""


def test_two_motors_of_two_speeds_have_no_period(nectosome):
    Path("wheels.yaml").write_text(TWO)
    done = nectosome("periodic", "wheels.yaml")
    assert (done.code, done.out) == (1, "")
    assert "The motors of first.angle and second.angle each find their own speed. Simulate the robot." in done.err

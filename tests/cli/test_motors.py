"""Robots with motors from the command line: what a servo cannot do is said, and ends with an exit code of 1."""

from pathlib import Path

import pytest
from tests.robots.test_powered import ARM, WHEEL
from tests.small_robots import SERVO

from nectosome.io import load_dataset

MOTOR = "torque_constant: 0.5 N m/A, resistance: 2 ohm, inertia: 0.02 kg m2, supply: 6 V"
RATE = "{full_voltage_at: 4 rad/s, integral_time: 0.3 s}"
LOOP = f"motion: {{kind: rate, rate: 14 rad/s}}, servo: {{{MOTOR}, velocity_loop: {RATE}}}"
FIN = f"""
name: fin
water: {{gravity: 0 m/s2}}
body:
  kind: rod
  section: circle
  length: 0.2 m
  radius: 5 mm
  young: 1 MPa
  density: 1100 kg/m3
  points: 3
  joint: {{kind: fixed}}
  drive: {{bending_z: {{ratio: 2, motor: {{{MOTOR}, voltage: {{kind: constant, value: 1 V}}}}}}}}
"""


@pytest.fixture
def arm():
    """An arm whose servo would need 14.7 V to hold it level."""
    held = ARM.replace("MOTION", "{kind: constant, value: 0 deg}").replace("TAKES", "regenerative: true")
    Path("arm.yaml").write_text(held.replace("mass: 0.6 kg", "mass: 1.25 kg"))


def test_an_arm_that_is_too_heavy_sags_and_is_told(nectosome, arm):
    answer = nectosome("static", "arm.yaml")
    assert answer.code == 1
    said = " ".join(answer.out.split())
    assert "warning: the servo of body.angle cannot follow its motion: its tracking error is up to" in said
    assert "body.angle" in answer.out and "current" in answer.out


def test_a_speed_that_is_out_of_reach_is_told(nectosome):
    start, end = WHEEL.index("joint:"), WHEEL.index("  loads")
    wheel = f"{WHEEL[:start]}joint: {{kind: revolute, axis: x, {LOOP}}}\n{WHEEL[end:]}"
    Path("wheel.yaml").write_text(wheel.replace("DRAG", "0.002"))
    answer = nectosome("steady", "wheel.yaml")
    assert answer.code == 1
    assert "the servo of body.angle cannot hold its speed: at its full voltage it lacks up to" in " ".join(
        answer.out.split()
    )


def test_models_of_the_catalogue_stand_side_by_side(nectosome):
    """With what each takes, and whether it is saturated."""
    Path("servo.yaml").write_text(SERVO)
    given = "--over", "body.joint.servo.model=XW540-T260-R,XW540-T140-R", "--set", "body.joint.motion.frequency=1.5Hz"
    answer = nectosome("sweep", "servo.yaml", *given, "--samples", "65", "--save", "s.nc", "--plot", "s.html")
    assert (answer.code, answer.err) == (0, "")
    rows = {line.split()[0]: line for line in answer.out.splitlines() if line.startswith("X")}
    assert " yes " in rows["XW540-T260-R"] and " no " in rows["XW540-T140-R"]
    assert "1 point at which a servo asks for more than its full voltage" in answer.out
    current = load_dataset("s.nc")["current_peak"].sel({"body.joint.servo.model": "XW540-T140-R"})
    assert f"{float(current.squeeze()):.4g} A" in rows["XW540-T140-R"]
    assert "XW540-T260-R" in Path("s.html").read_text()


def test_a_motor_that_drives_a_strain_is_shown_with_its_rod(nectosome):
    """And what stands among the motors of a run has the name of its shaft."""
    Path("fin.yaml").write_text(FIN)
    said = nectosome("show", "fin.yaml").out
    assert "drive of bending_z  ratio 2, motor torque constant 0.5 N m/A" in said
    assert "moves  1 degree of freedom: bending_z" in said
    answer = nectosome("simulate", "fin.yaml", "--time", "0.1s")
    assert (answer.code, answer.err) == (0, "")
    (row,) = [line.split() for line in answer.out.splitlines() if line.startswith("body.bending_z.angle")]
    assert row[2] == "N" and "rad/s" in row

"""`periodic` on small robots: what it prints, saves and refuses; servos against their limits."""

import json
from pathlib import Path

import numpy as np
import pytest
from tests.small_robots import SHAKEN

from nectosome.io import load_dataset

from .answers import check_wrong

# an arm that a servo swings to and fro, and on it a bob that a spring holds; there is next to no water
SERVO = """
name: servo
water: {density: 1e-9 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 2e-3 kg m2]
  joint:
    kind: revolute
    axis: z
    motion: {kind: stroke, amplitude: 30 deg, frequency: 2 Hz}
    limits: {torque: 5 N m, speed: 60 rpm}
limbs:
  bob:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
    joint: {kind: revolute, axis: z, damping: 0.02 N m s/rad, flexure: FLEXURE}
""".replace("FLEXURE", "{gap: 44 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}")
HANGING = SHAKEN.replace("position: 1e-3 rad, ", "")
A, W = np.radians(30), 2 * np.pi * 2
STIFFNESS = 2e6 * (0.04 * 0.006**3 / 12) / 0.044  # N m/rad
SWING = A * 1e-3 * W**2 / (STIFFNESS - 1e-3 * W**2 + 0.02j * W)  # of the bob against the arm
BURNT = 0.02 * W**2 * abs(SWING) ** 2 / 2  # by the damper [W]


def rows(page: str) -> dict[str, list[str]]:
    """The columns of each row of a page, by the row's name."""
    return {line.split("  ")[0]: line.split() for line in page.splitlines() if line}


def drives(page: str) -> dict[str, list[str]]:
    """The columns of the first table, by the name of the joint."""
    return rows(page.partition("power into the robot")[0].replace(" N m ", " N_m "))


@pytest.fixture
def servo(tmp_path) -> Path:
    file = tmp_path / "servo.yaml"
    file.write_text(SERVO)
    return file


@pytest.mark.slow
@pytest.mark.usefixtures("servo")
def test_a_servo_that_swings_a_bob_gives_what_the_damper_burns(nectosome):
    """P = c w^2 X^2 / 2; the fastest speed A w is beyond the servo's; stress E h X (pi ratio^2)/(2 L) at the face."""
    done = nectosome("periodic", "servo.yaml")
    assert (done.code, done.err) == (1, "")  # beyond a limit
    page = rows(done.out)
    assert "servo: periodic motion, period 500 ms" in done.out
    drive = drives(done.out)["body.angle"]
    torque = abs(-2e-3 * W**2 * A - STIFFNESS * SWING - 0.02j * W * SWING)
    assert [float(drive[i]) for i in (2, 4)] == pytest.approx([torque, A * W], rel=2e-3)
    assert float(page["drives"][1]) == pytest.approx(BURNT, rel=1e-3)
    strain = 0.006 * abs(SWING) / (2 * 0.044)
    assert float(page["hinge of bob"][3]) == pytest.approx(strain, rel=2e-3)
    assert "cost of transport" not in page
    assert rows(done.out.partition("servo  ")[2])["body.angle"][-2] == f"{100 * A * W / (2 * np.pi):.0f}"
    assert float(page["damper"][1]) == pytest.approx(-BURNT, rel=2e-3)
    assert page["spring"][1] == page["sum"][1] == "0"  # it gives back what it takes
    assert "warning: the servo of body.angle would exceed its limit of speed" in done.out
    assert "status: SOLVED, solved; " in done.out


@pytest.mark.usefixtures("servo")
def test_simulate_tells_of_servos_too(nectosome):
    done = nectosome("simulate", "servo.yaml", "--time", "0.5s", "--set", "body.joint.limits.speed=120 rpm")
    assert (done.code, done.err) == (0, "")
    servo = rows(done.out.partition("servo  ")[2])["body.angle"]
    assert servo[7:] == [f"{A * W:.4g}", "12.57", "rad/s", f"{100 * A * W / (4 * np.pi):.0f}", "%"]
    assert "warning" not in done.out


def shake(nectosome, frequency: float, *options: str):
    """Find the cycle of a pendulum that hangs on what is shaken up and down."""
    Path("shaken.yaml").write_text(HANGING)
    return nectosome("periodic", "shaken.yaml", "--set", f"f={frequency} Hz", *options)


def test_what_shakes_a_hanging_bob_carries_both(nectosome):
    """Reaction 2 m (g + z''): mean 2 m g, largest 2 m (g + A w^2), which falls on a sample; no power on the mean."""
    done = shake(nectosome, 1.4, "--save", "cycle.nc")
    assert (done.code, done.err) == (0, "")
    assert "shaken: periodic motion, period 714.3 ms" in done.out
    drive, page = drives(done.out)["body.position"], rows(done.out)
    w = 2 * np.pi * 1.4
    assert [float(drive[i]) for i in (1, 2, 4)] == pytest.approx(
        [2 * 9.81, 2 * (9.81 + 0.06 * w**2), 0.06 * w], rel=1e-3
    )
    mean, largest = page["body.position"][1:3]  # of its power: 2 (g + z'') z' with z' = A w cos w t
    t = np.linspace(0, 1 / 1.4, 20_001)
    power = 2 * (9.81 - 0.06 * w**2 * np.sin(w * t)) * 0.06 * w * np.cos(w * t)
    assert mean == "0"
    assert float(largest) == pytest.approx(abs(power).max(), rel=1e-3)
    assert page["speed"][1] == page["sum"][1] == "0"
    assert "mean powers: off balance by 0\n" in done.out
    assert not {"cost of transport", "quasi-propulsive efficiency", "stroke", "hinge of bob"} & set(page)
    assert "status: SOLVED, solved; " in done.out
    dataset = load_dataset("cycle.nc")
    assert dataset.sizes["time"] == 129
    assert dataset["multiplier_real"].sizes["multiplier"] == 2
    shown = nectosome("show", "cycle.nc")
    assert (shown.code, shown.err) == (0, "")
    powers = rows(shown.out.partition("power into the robot")[2])  # the means over all of the cycle; none where it is 0
    assert float(powers.get("body.position", ["", "0"])[1]) == pytest.approx(0, abs=1e-9)
    assert float(drives(shown.out)["body.position"][1]) == pytest.approx(2 * 9.81, rel=1e-3)


def test_a_cycle_that_does_not_last_is_shown_and_told(nectosome):
    """Shaken at twice its own frequency a pendulum does not go on hanging still (Mathieu)."""
    done = shake(nectosome, 0.70486)
    assert done.code == 1
    assert done.err == "shaken: found, but unstable: small disturbances grow.\n"
    assert "status: UNSTABLE" in done.out
    said = " ".join(done.out.split()).split("largest multiplier ")[1].split()
    assert float(said[0]) - float(said[2].rstrip(",")) > 1.01
    assert said[1] == "+-"


@pytest.mark.usefixtures("servo")
def test_another_period_is_no_cycle_and_the_way_out_is_told(nectosome):
    done = nectosome("periodic", "servo.yaml", "--period", "0.3s", "--save", "cycle.nc")
    assert (done.code, done.out) == (1, "")
    assert done.err.startswith("servo: drives or loads do not have this period. Leave --period out")
    assert not Path("cycle.nc").exists()


FALLING = """
name: falling
water: {density: 1000 kg/m3}
body: {kind: rigid, shape: point, mass: MASS kg, volume: 900 mL, joint: {kind: prismatic, axis: z}}
limbs:
  vane:
    kind: rigid
    shape: point
    mass: 100 g
    volume: 100 mL
    inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 2 Hz}}
"""


def test_what_never_comes_back_says_what_it_does_instead_in_text_and_json(nectosome):
    """A constant push without drag adds as much velocity in each period."""
    pushed = FALLING.replace("MASS", "1").replace("volume: 900 mL, ", "volume: 1 L, ")
    pushed = pushed.replace("kind: prismatic, axis: z}}", "kind: prismatic, axis: x}, loads: {push: PUSH}}")
    Path("pushed.yaml").write_text(pushed.replace("PUSH", "{kind: force, force: [1 N, 0 N, 0 N]}"))
    done = nectosome("periodic", "pushed.yaml", "--json")
    found = json.loads(done.out)
    assert (done.code, found["status"]) == (1, "NO_PERIOD")
    assert found["instead"]["kind"] == "drifts"
    assert "no periodic motion found. Each period adds as much to the motion as the one before" in done.err


@pytest.mark.parametrize(("mass", "said"), [("1", "It sinks, at last at "), ("0.8", "It rises, at last at ")])
def test_what_sinks_or_rises_for_want_of_drag_is_told_with_its_weight_in_water(nectosome, mass, said):
    """0.1 kg too heavy or too light: 0.9807 N."""
    Path("falling.yaml").write_text(FALLING.replace("MASS", mass))
    answer = nectosome("periodic", "falling.yaml")
    assert answer.code == 1
    assert answer.err.startswith(f"falling: no periodic motion found. {said}")
    more, less = ("weight", "buoyancy") if mass == "1" else ("buoyancy", "weight")
    assert f"its {more} exceeds its {less} by 0.9807 N; neutral with body.mass 0.9 kg." in answer.err
    assert "hold its depth by its joint, or see nectosome simulate." in answer.err


@pytest.mark.usefixtures("servo", "ball")
def test_wrong_input_is_answered_with_one_sentence_and_exit_code_2(nectosome, tmp_path):
    robot = ("periodic", "servo.yaml")
    times = ("", "3", "0s", "-1s", "nan s", "inf s", "3 m", "s", "three seconds")
    counts = ("", "0", "16", "-5", "33.5", "nan", "many", "10001", "9" * 30)
    settings = ("", "E=3MPa", "body.joint.motion.frequency=2", "body.joint.limits.torque=0 N m")
    settings += ("body.joint.motion.amplitude=0 rad", "body.joint.limits.speed=3 m/s")
    cases = [(*robot, "--period", time) for time in times]
    cases += [(*robot, "--samples", count) for count in counts]
    cases += [(*robot, "--set", setting) for setting in settings]
    cases += [("periodic", "ball.yaml"), ("periodic", "ball.yaml", "--set", "body.joint={kind: fixed}")]
    check_wrong(nectosome, cases, tmp_path)

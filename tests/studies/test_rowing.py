"""The rowing robot's study: straight swims, tolerances, the IMU, steering and control."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import get_value, numeric_paths, resolve, with_values
from nectosome.model import build
from nectosome.robots import beetle, describe
from nectosome.robots.beetle import PADDLES
from nectosome.solve import simulate
from nectosome_studies.paddle import trials
from nectosome_studies.paddle.carried import carrying
from nectosome_studies.paddle.steering import HalfStrokes, HeadingControl, disturbed, swim, turn
from nectosome_studies.paddle.swim import drop_factor, on_a_slide, slide_speed, with_ideal_drives

CALIBRATED = 0.017243  # m2: drag area of the hull, of ideal drives


@pytest.fixture(scope="module")
def one_joint():
    """The robot with ideal drives and the hull that they are calibrated with."""
    return with_values(with_ideal_drives(describe("beetle1")), {"drag_area": CALIBRATED})


@pytest.mark.slow
@pytest.mark.parametrize("drives", [beetle, lambda joints: with_ideal_drives(beetle(joints))], ids=["servos", "ideal"])
def test_a_fourfold_paddle_on_a_slide_swims_as_four_do(drives):
    ways = []
    for description in (drives(1), on_a_slide(drives(1))):
        run = simulate(build(description), 0.6, samples=7, rtol=1e-9, atol=1e-11)
        ways.append(np.asarray(run.value.state.q)[:, 0])
    assert ways[0][-1] > 0.05
    np.testing.assert_allclose(ways[1], ways[0], rtol=0, atol=1e-9)


def test_robots_are_made_within_the_tolerances():
    """Spread of many: as the recipe says; parts of one paddle share its mass and Cn; the description stays."""
    robot, rng = describe("beetle"), np.random.default_rng(0)
    made = [trials.made(robot, rng) for _ in range(100)]

    def ratios(end: str) -> np.ndarray:
        names = [f"limbs.{p}_segment{k}.{end}" for p in ("left1", "right1", "left2", "right2") for k in (1, 2, 3)]
        return np.array([[get_value(m, name) / get_value(robot, name) for name in names] for m in made])

    young, mass, cn = (ratios(end) for end in ("joint.flexure.young", "mass", "loads.drag.normal"))
    assert young.std() == pytest.approx(0.0184, rel=0.1)
    assert mass.std() == pytest.approx(0.0240, rel=0.1)
    assert np.abs(cn - 1).max() == pytest.approx(0.0125, rel=0.02)
    assert np.ptp(mass.reshape(100, 4, 3), axis=2).max() == np.ptp(cn.reshape(100, 4, 3), axis=2).max() == 0
    assert np.abs(np.corrcoef(young.T)[np.triu_indices(12, 1)]).max() < 0.4
    amplitude = np.array([[get_value(m, name) for name in resolve(robot, "A")] for m in made])
    assert np.degrees(np.abs(amplitude - np.radians(75)).max()) == pytest.approx(0.169, rel=0.02)
    phase = np.array([[get_value(m, f"phase_{p}") for p in ("left1", "right1", "left2", "right2")] for m in made])
    lag = -phase / (2 * np.pi * 1.1)
    assert 0 <= lag.min() < 1e-3 and 8e-3 < lag.max() <= 8.34e-3


def test_servos_differ_in_their_speed_alone_and_within_five_percent():
    """What differs can be the paddles or the servos alone; a seed means the same paddles with servos and without."""
    robot = describe("beetle1")
    ideal = with_ideal_drives(robot)
    paths = [f"limbs.{p}_arm.joint.servo.no_load_speed" for p in PADDLES]

    def speeds(differ: str, seed: int) -> list[float]:
        made = trials.made(robot, np.random.default_rng(seed), differ)
        return [get_value(made, path) / get_value(robot, path) for path in paths]

    drawn = np.array([speeds("all", seed) for seed in range(100)])
    assert 0.048 < np.abs(drawn - 1).max() <= 0.05
    assert speeds("paddles", 0) == [1.0] * 4 and speeds("servos", 0) == speeds("all", 0)
    both, one, other = (
        trials.made(robot_, np.random.default_rng(3), differ)
        for robot_, differ in ((robot, "all"), (ideal, "all"), (robot, "servos"))
    )
    same = numeric_paths(ideal)
    assert [get_value(both, path) for path in same] == [get_value(one, path) for path in same]
    assert [get_value(other, path) for path in same] == [get_value(robot, path) for path in same]


@pytest.mark.slow
def test_plates_that_carry_water_along_reverse_the_order_of_three_joints_and_one():
    """At 75 deg and 1.1 Hz, drag area of the hull as calibrated; a plate on a slide carries that of four."""
    speed = {
        (n, share): slide_speed(
            on_a_slide(carrying(with_ideal_drives(beetle(n)), share)), np.radians(75), 1.1, CALIBRATED
        )
        for n in (1, 3)
        for share in (0.0, 1.0)
    }
    assert speed[3, 0.0] == pytest.approx(0.323, rel=1e-4)
    assert speed[3, 0.0] > speed[1, 0.0] and speed[3, 1.0] < 0.7 * speed[1, 1.0]


@pytest.mark.slow
def test_stops_keep_no_cycle_from_being_found():
    """Their jitter ends Newton's method at gaps within the accepted noise; the speed falls with the drag area."""
    robot = on_a_slide(carrying(with_ideal_drives(beetle(1)), 1.0))
    areas = np.append(np.linspace(0.0168, 0.018, 5), 0.01724347210526972)  # the last needs all corrections
    speed = [slide_speed(robot, np.radians(75), 1.1, area) for area in np.sort(areas)]
    assert np.all(np.diff(speed) < 0)
    assert speed[0] / speed[-1] == pytest.approx((0.018 / 0.0168) ** 0.5, rel=0.03)  # thrust against quadratic drag


def test_a_slide_carries_the_water_of_four_paddles():
    robot = carrying(describe("beetle1"), 0.7)
    assert get_value(on_a_slide(robot), "limbs.left1_segment1.loads.water.normal") == pytest.approx(2.8)


def test_the_imu_has_noise_and_wraps():
    true = np.linspace(-7, 7, 4000)
    seen = trials.measured_yaw(true, np.random.default_rng(0))
    assert np.abs(seen).max() <= np.pi
    noise = np.angle(np.exp(1j * (seen - true)))
    assert np.degrees(noise.std()) == pytest.approx(0.1, rel=0.05)


def test_the_drop_is_off_unless_asked_for():
    assert drop_factor(1.3) == drop_factor(1.1, slope=3.0) == drop_factor(0.3, slope=3.0) == 1.0
    assert drop_factor(1.3, slope=3.0) == pytest.approx(0.4)
    assert drop_factor(2.0, slope=3.0) == 0.0


def test_new_amplitudes_move_no_servo_at_once(one_joint):
    """Angle and speed at the end of each half stroke are those at the start of the next."""
    rowing = HalfStrokes(one_joint)
    points = np.radians([[75, 75], [60, 75], [75, 40], [30, 75], [75, 75]])
    ends = []
    for k in range(4):
        arms = [part for part in rowing.robot(k, points[k], points[k + 1]).tree.parts if part.name.endswith("_arm")]
        ends.append([[arm.prescribed(jnp.asarray(t))[:2] for t in (1e-12, 0.5 / 1.1 - 1e-12)] for arm in arms])
    angle, rate = np.moveaxis(np.array(ends), -1, 0)
    assert np.abs(rate).max() < 1e-9
    np.testing.assert_allclose(angle[:-1, :, 1], angle[1:, :, 0], atol=1e-9)
    sides = np.array([1, -1, 1, -1])[:, None] * points[1:]
    np.testing.assert_allclose(angle[:, :, 1], np.tile(sides, 2), atol=1e-9)


@pytest.mark.slow
def test_a_controlled_robot_holds_its_heading(one_joint):
    """Against a weak paddle and a steady yaw moment that turn it away when it is left to itself."""
    weak = disturbed(one_joint)
    control = HeadingControl(np.radians(75), 0.6, 0.5, 0.1, np.radians(30))
    alone, held = swim(weak, 16), swim(weak, 16, control)
    assert float(alone["yaw"][-1]) > np.radians(60)
    assert float(np.abs(held["yaw"]).max()) < np.radians(8)
    late = held["yaw"].values[-320:]
    assert np.ptp(late) < np.radians(4)
    assert abs(late.mean()) < np.radians(1.5)  # by its integral; 5 deg without
    assert held["x"][-1] - held["x"][0] > 3.0


@pytest.mark.slow
def test_steady_turns_are_mirrored_and_go_to_the_side_that_rows_less(one_joint):
    """And it goes straight with equal strokes; the circle is that of the turning rate and the speed."""
    less, full = np.radians([65.0, 75.0])
    left, right, ahead = turn(one_joint, less, full), turn(one_joint, full, less), turn(one_joint, full, full)
    assert left.rate > 0.2
    np.testing.assert_allclose([-right.rate, right.radius, right.speed], left[:3], rtol=1e-5)
    # a derivative through steps that keep the errors of the state small, not its own
    assert right.multiplier == pytest.approx(left.multiplier, rel=1e-3)
    assert left.multiplier < 0.9  # it lasts
    assert left.radius == pytest.approx(left.speed / left.rate, rel=0.02)  # the chord is a little shorter than the arc
    assert abs(ahead.rate) < 1e-9
    assert ahead.radius > 1e6
    assert ahead.speed > left.speed

"""The rowing robot: what it is made of, symmetry, conservation, and its two forms."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.core import Status
from nectosome.description import get_value, resolve, with_values
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate
from nectosome.units import InputError

TIGHT = {"rtol": 1e-9, "atol": 1e-11}
LESS = np.radians(60.0)
TIME, SAMPLES = 0.4, 5


def swims(description, finer=1.0, **values):
    steps = {name: finer * tolerance for name, tolerance in TIGHT.items()}
    run = simulate(build(with_values(description, values)), TIME, samples=SAMPLES, **steps)
    assert int(run.status) == Status.SOLVED
    return run


@pytest.fixture(scope="module")
def one_joint():
    """The robot with one joint a paddle."""
    return describe("beetle1")


@pytest.fixture(scope="module")
def straight(one_joint):
    return swims(one_joint)


@pytest.fixture(scope="module")
def turning(one_joint):
    """Its left side rows less."""
    return swims(one_joint, A_left=LESS)


def test_it_has_the_printed_mass_and_size(straight):
    """2.5 kg, neutrally buoyant; 0.426 m long; from tip to tip 0.11 m and four times 0.105 m."""
    robot = straight.value.system
    assert float(np.sum(robot.weight())) == pytest.approx(2.5)
    assert float(np.sum(robot.tree.stations.volume)) == pytest.approx(2.5e-3)
    for name in ("beetle", "beetle_free"):
        d = describe(name)
        assert get_value(d, "body.length") == pytest.approx(0.426)
        assert 2 * (get_value(d, "limbs.left1_arm.offset.1") + 2 * 0.105) == pytest.approx(0.53)
        assert len(resolve(d, "Cn")) == 12
    assert describe("beetle", ["N=1"]) == describe("beetle1")
    assert describe("beetle") == describe("beetle3")
    for wrong in ("0", "6", "two"):
        with pytest.raises(InputError):
            describe("beetle", [f"N={wrong}"])


def test_its_servos_are_asked_for_more_than_they_have_and_lag_behind(straight):
    """75 deg at 1.1 Hz is 86 rpm of servos that make 67: none turns faster, or pushes more than its sheet allows."""
    run = straight.to_dataset()
    stroke = np.radians(75) * 2 * np.pi * 1.1
    speed = np.abs(run["motor_rate"].values)
    assert stroke > 1.2 * 7.016 and speed.max() < 7.016
    assert np.all(np.abs(run["motor_torque"].values) <= 6.4 * (1 + speed / 7.016))
    assert float(np.abs(run["tracking_error"]).max()) > np.radians(12.5)
    assert get_value(describe("beetle"), "drag_area") == pytest.approx(0.82 * np.pi * 0.055**2)


def test_a_symmetric_robot_swims_straight(straight):
    q = np.asarray(straight.value.state.q)
    assert np.abs(q[:, 1:3]).max() < 1e-8
    assert q[-1, 0] > 0.05


@pytest.mark.slow
def test_mirrored_strokes_give_mirrored_turns(one_joint, turning):
    """And the robot turns to the side that rows less."""
    left, right = (np.asarray(run.value.state.q)[:, :3] for run in (turning, swims(one_joint, A_right=LESS)))
    assert left[-1, 2] > 0.03
    np.testing.assert_allclose(right, left * [1, -1, -1], rtol=0, atol=1e-8)


@pytest.mark.slow
def test_its_power_is_accounted_for(turning):
    assert turning.to_dataset()["power_balance"].max() < 1e-6


def test_without_water_its_momentum_stays(one_joint):
    """At nothing, as before the servos began. Drag and added mass go with the density."""
    run = swims(one_joint, 0.3, A_left=LESS, **{"water.density": 1e-12}).to_dataset()
    assert np.ptp(run["q"].values, axis=0).max() > 0.1
    for name, size in (("momentum", 0.06), ("angular_momentum", 0.003)):  # sizes of what its paddles carry
        np.testing.assert_allclose(run[name].values, 0.0, atol=5e-8 * size)


@pytest.mark.slow
def test_the_planar_form_moves_as_the_free_one(turning):
    free = np.asarray(swims(describe("beetle_free1"), A_left=LESS).value.state.q)
    vectors = Rotation.from_quat(free[:, 3:7], scalar_first=True).as_rotvec()
    planar = np.asarray(turning.value.state.q)
    np.testing.assert_allclose(free[:, :2], planar[:, :2], rtol=0, atol=1e-7)
    np.testing.assert_allclose(vectors, np.pad(planar[:, 2:3], ((0, 0), (2, 0))), rtol=0, atol=1e-7)
    np.testing.assert_allclose(free[:, 7:], planar[:, 3:], rtol=0, atol=1e-6)

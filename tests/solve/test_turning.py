"""Four flagella on a free canister: the cycles in which they roll, swim straight and turn, against their symmetries."""

import numpy as np
import pytest

from nectosome.core import Status
from nectosome.model import build
from nectosome.robots import flagella
from nectosome.solve import periodic, screw_of

FAST = 14.4  # rad/s
pytestmark = pytest.mark.slow


def robot_of(rates):
    """Four flagella at those rates [rad/s], mirror images where they turn the other way, that bend evenly."""
    robot = flagella(4)
    limbs = dict(robot.limbs)
    for k, rate in enumerate(rates, start=1):
        shaft, hook, filament = (limbs[f"{name}{k}"] for name in ("shaft", "hook", "filament"))
        motion = shaft.joint.motion.model_copy(update={"rate": rate})
        drag = hook.loads["drag"].model_copy(update={"lift": -0.1 * np.sign(rate)})
        loads = {**hook.loads, "drag": drag}
        coarse = {"strains": {"bending_y": 0, "bending_z": 0}, "points": 3, "loads": loads}
        limbs[f"shaft{k}"] = shaft.model_copy(update={"joint": shaft.joint.model_copy(update={"motion": motion})})
        limbs[f"hook{k}"] = hook.model_copy(update={"loads": loads})
        limbs[f"filament{k}"] = filament.model_copy(update=coarse)
    return build(robot.model_copy(update={"limbs": limbs}))


def cycle(shares, turns=1):
    """Cycle with the motors at those shares of the fast rate, `turns` revolutions of the fast ones."""
    found = periodic(robot_of(FAST * np.array(shares)), 2 * np.pi * turns / FAST)
    assert int(found.status) == Status.SOLVED
    return found


@pytest.fixture(scope="module")
def straight():
    return cycle([1, -1, 1, -1])


@pytest.fixture(scope="module")
def rolling():
    return cycle([1, 1, 1, 1])


@pytest.fixture(scope="module")
def turning():
    return cycle([1, -1, 0.5, -0.5], turns=2)


def twists(found):
    return np.asarray(found.value.state.v)[:, :6]


def screw(found):
    run = found.results().arrays
    return screw_of(*((run["rotation"][i, 0], run["position"][i, 0]) for i in (0, -1)))


def test_mirror_images_in_pairs_neither_roll_nor_turn(straight):
    """In the frame of the canister nothing but the motors moves: its twist is constant, and along x."""
    v = twists(straight)
    assert np.all(v[:, 3] < -0.1)  # m/s, forward
    np.testing.assert_allclose(v[:, [0, 1, 2, 4, 5]], 0, atol=1e-8)
    np.testing.assert_allclose(v[:, 3], v[0, 3], rtol=1e-6)


def test_flagella_that_all_turn_one_way_roll_the_body_the_other_way(rolling):
    """Their fourfold symmetry keeps it on its axis."""
    v = twists(rolling)
    assert np.all(v[:, 0] < -1)  # rad/s
    np.testing.assert_allclose(v[:, [1, 2, 4, 5]], 0, atol=1e-9)


def test_swapping_the_speeds_mirrors_the_motion(turning):
    """The plane of x and (0, 1, -1) mirrors 1 to 4, 2 to 3, velocities to (x, -z, -y), angular ones to (-x, z, y)."""
    v, w = twists(turning), twists(cycle([0.5, -0.5, 1, -1], turns=2))
    mirrored = np.stack([-v[:, 0], v[:, 2], v[:, 1], v[:, 3], -v[:, 5], -v[:, 4]], axis=1)
    np.testing.assert_allclose(w, mirrored, atol=1e-6)


def test_a_slower_pair_turns_the_robot_in_a_circle(turning):
    """The plane of x and (0, 1, 1) mirrors 1 to 2 and 3 to 4: the robot stays in it, and does not roll."""
    np.testing.assert_allclose(twists(turning)[:, 0], 0, atol=1e-9)
    circle = screw(turning)
    np.testing.assert_allclose(np.abs(circle.axis), np.array([0, 1, 1]) / np.sqrt(2), atol=1e-6)
    assert circle.angle > 0.01
    assert abs(circle.along) < 1e-6


@pytest.mark.parametrize("motion", ["straight", "rolling", "turning"])
def test_over_a_cycle_loads_take_what_drives_give(motion, request):
    run = request.getfixturevalue(motion).results().arrays
    drives, loads = (
        np.trapezoid(p, run["time"]) for p in (run["reaction_power"].sum(axis=1), run["load_power"].sum(axis=(1, 2)))
    )
    assert drives > 0
    assert abs(drives + loads) < 1e-6 * drives
    assert np.max(run["power_balance"]) < 1e-6

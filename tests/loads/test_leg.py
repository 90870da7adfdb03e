"""Legs on the ground: the mechanism, standing, sticking, slipping, and walking against an engine of its own."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import nectosome.loads as ld
from nectosome.core import Stations, Strips, Water
from nectosome.description import RobotDescription
from nectosome.mechanism import in_plane, moves_in_plane
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import fixed_step, simulate
from nectosome.solve.soft_contacts import soft_contacts
from nectosome.units import InputError

OMEGA, MASS, G = 12.4602, 0.755, 9.80665
WEIGHT = MASS * G - 0.609854604e-3 * 1025 * G  # in water [N]
_n = jnp.asarray


@pytest.fixture(scope="module")
def walk():
    """Positions (x, z, pitch) of the crawler, or of one that is changed, at the ends of steps."""

    def run(robot, step, count):
        system = in_plane(robot) if robot.initial().v.size == 3 else robot
        return fixed_step(system, _n(0.0), robot.initial(), step, count, keep=lambda x: x.q)[1]

    run = jax.jit(run, static_argnums=2)

    def walked(*changes, seconds=2.0, step=1e-3, robot=None):
        robot = build(describe("poseidrone_crawl", list(changes))) if robot is None else robot
        return np.asarray(run(robot, _n(step), round(seconds / step)))

    return walked


def test_the_foot_is_where_a_bar_through_a_bearing_ends():
    """Straight below at top and bottom of the turn; ahead and behind by (L/|B - P|) of what the pin is off."""
    r, d, L = 0.0105, 0.0998, 0.1263
    contact = ld.GroundContact(_n(200.0), _n(0.8), _n(0.6), _n(0.001), pulls=False)
    leg = ld.Leg(_n([0.04, 0.0, 0.005]), _n(r), _n([0.0, -d]), _n(L), _n(OMEGA), _n(0.0), contact, *[_n(1.0)] * 4)
    for crank, place in (
        (np.pi / 2, (0.0, r - L)),
        (-np.pi / 2, (0.0, -r - L)),
        (0.0, (r - L * r / np.hypot(r, d), -L * d / np.hypot(r, d))),
        (np.pi, (L * r / np.hypot(r, d) - r, -L * d / np.hypot(r, d))),
    ):
        np.testing.assert_allclose(leg.foot(_n(crank))[0], place, atol=1e-15)
    q, dq = jax.jvp(lambda angle: jnp.stack(leg.foot(angle)[0]), (_n(3.7),), (_n(1.0),))
    np.testing.assert_allclose(leg.foot(_n(3.7))[1], dq, rtol=1e-12)
    assert np.all(np.isfinite(q))


def test_a_leg_drags_through_the_water_as_its_foot_moves_whatever_the_body_does():
    """F = -l_t |u_t| u_t - l_n |u_n| u_n along and across the leg, u = v + w x r, and the moment r x F."""
    contact = ld.GroundContact(_n(200.0), _n(0.8), _n(0.6), _n(0.001), pulls=False)
    numbers = map(_n, (0.5, 0.3, 1.7, 2.0))  # damping ratio, along, across, legs side by side
    hip = np.array([0.04, -0.03, 0.005])
    leg = ld.Leg(_n(hip), _n(0.0105), _n([0.0, -0.0998]), _n(0.1263), _n(0.0), _n(0.7), contact, *numbers)
    (x, z), _, (ux, uz) = leg.foot(_n(0.7))
    r, along = hip + np.array([x, 0.0, z]), np.array([ux, 0.0, uz])
    v, w = np.array([0.2, -0.3, 0.1]), np.array([0.5, -1.5, 2.5])
    own = Stations.along(_n([0.0]), _n([0.1]), _n([[0.05, 0.05]]), _n([1e-3]), jnp.eye(6)[None])
    moving = {"rotation": jnp.eye(3)[None], "position": jnp.zeros((1, 3))}
    strips = Strips(**vars(own), **moving, angular_velocity=_n(w)[None], velocity=_n(v)[None])
    found, _ = leg.force(_n(0.0), strips, leg.initial(), Water(_n(1000.0), _n(G)))
    u = v + np.cross(w, r)
    across = u - (u @ along) * along
    force = -2.0 * (0.3 * abs(u @ along) * (u @ along) * along + 1.7 * np.linalg.norm(across) * across)
    np.testing.assert_allclose(found[0], [*np.cross(r, force), *force], rtol=1e-12)


# legs far apart and buoyancy high up: upright, whatever pushes
STILL = (
    "omega=0 rad/s",
    "limbs.module.offset=[0 m, 0 m, 5 m]",
    "body.loads.front.hip.0=0.2 m",
    "body.loads.rear.hip.0=-0.2 m",
)


def test_a_robot_that_stands_presses_with_its_weight_in_water(walk):
    """Four springs of 205.8 N/m under (0.755 kg - 0.6099 L of water) g: 1.55 mm below feet at 131.9 mm."""
    height = walk(*STILL, seconds=6.0)[-1, 1]
    assert height == pytest.approx(0.1263 + 0.0105 - 0.0049 - WEIGHT / (4 * 205.8), abs=1e-6)


def test_legs_that_are_too_soft_to_hold_are_told():
    """At the bottom of its turn a leg is 126.3 - 99.8 + 10.5 = 37 mm below its bearing, its foot 131.9 mm deep."""
    robot = build(describe("poseidrone_crawl", list(STILL)))
    start, deep = robot.initial(), jnp.array([0.9, 1.2, 1.1]) * 0.037
    height = 0.1319 - deep
    states = jax.tree.map(lambda x: jnp.broadcast_to(x, (3, *jnp.shape(x))), start)
    (upright,) = (i for i, x in enumerate(start.q.tolist()) if x == 0.13)
    states = eqx.tree_at(lambda x: x.q, states, states.q.at[:, upright].set(height))
    said = soft_contacts(robot, _n([0.0, 1.0, 2.0]), states)
    assert [words.split(":")[0] for words in said] == ["front", "rear"]
    depth = "has a foot in the floor by 1.2 times the length of the leg below its bearing at 1 s"
    assert all(depth in words and "raise body.loads." in words for words in said)
    assert soft_contacts(robot, _n([0.0]), jax.tree.map(lambda x: x[:1], states)) == []


def _pushed(force):
    """Standing on slippery ground, pushed at its centre of mass by so many times its weight in water."""
    data = describe(
        "poseidrone_crawl", [*STILL, "mu_s=0.2", "mu_d=0.1", "d_r=4", "body.joint.start.position.2=130.35 mm"]
    ).model_dump(exclude_unset=True)
    data["body"]["loads"]["push"] = {"kind": "force", "force": (force * WEIGHT, 0.0, 0.0)}
    return build(RobotDescription.model_validate(data))


def test_feet_stick_up_to_static_friction(walk):
    """mu_s 0.2: pushed with 0.15 of its weight it leans on its springs and stays; with 0.25 it slides off."""
    held, gone = (walk(robot=_pushed(force), seconds=8.0)[:, 0] for force in (0.15, 0.25))
    assert abs(held[-1] - held[-1001]) < 1e-6
    assert 0.15 * WEIGHT / (4 * 205.8) < held[-1] < 0.01
    assert gone[-1] - gone[-1001] > 0.05


def test_sliding_feet_brake_with_dynamic_friction(walk):
    """What slides at last: drag and mu_d W carry the push, 31.8 v^2 = (0.3 - 0.1) W."""
    x = walk(robot=_pushed(0.3), seconds=8.0)[:, 0]
    assert x[-1] - x[-1001] == pytest.approx(np.sqrt((0.3 - 0.1) * WEIGHT / 31.8), rel=0.02)


def _rate(t, s):
    """The crawler's equations, written anew: planar, numbers of Table 3, feet that pull through their dampers."""
    k, ratio, mu_s, mu_d, added, J, drag, turning, along, across = (
        *(205.8, 1.1, 0.77, 0.61, 6.65, 0.018, 63.6, 0.068, 0.026, 0.033),
    )
    r, d, L, hx, hy = 0.0105, 0.0998, 0.1263, 0.0366, 0.0049
    _, y, th, vx, vy, w = s[:6]
    R = np.array([[np.cos(th), -np.sin(th)], [np.sin(th), np.cos(th)]])
    v, c = np.array([vx, vy]), 2 * ratio * np.sqrt(k * MASS)
    body = R.T @ v
    force = R @ (-0.5 * drag * np.abs(body) * body) + [0.0, -WEIGHT]
    bx, _ = R @ [0.0196329, 0.0878325]
    moment = 0.609854604e-3 * 1025 * G * bx - turning * abs(w) * w
    stretch = []
    phi = OMEGA * t - np.pi / 2
    for hip, e in ((hx, s[6]), (-hx, s[7])):
        pin, dpin = r * np.array([np.cos(phi), np.sin(phi)]), r * OMEGA * np.array([-np.sin(phi), np.cos(phi)])
        to = np.array([0.0, -d]) - pin
        n = np.linalg.norm(to)
        u = to / n
        foot, dfoot = np.array([hip, hy]) + pin + L * u, dpin + L * (-dpin + u * (u @ dpin)) / n
        arm, u = R @ foot, R @ u
        vf = v + w * np.array([-arm[1], arm[0]]) + R @ dfoot
        depth = -(y + arm[1])
        grip = np.clip(depth / 1e-3, 0, 1)
        up = k * max(depth, 0) - grip * c * vf[1]
        held = k * e - c * vf[0]
        push = max(up, 0.0)
        excess = max(abs(held) / push - mu_s, 0) if push > 0 else 0.0
        most = (mu_d + (mu_s - mu_d) * np.exp(-excess / 0.05)) * push
        slide = np.clip(held, -most, most)
        stretch.append((slide - k * e) / c)
        normal = np.array([-u[1], u[0]])
        vt, vn = vf @ u, vf @ normal
        f = -(1 - grip) * (along * abs(vt) * vt * u + across * abs(vn) * vn * normal) + [slide, up]
        force, moment = force + 2 * f, moment + 2 * (arm[0] * f[1] - arm[1] * f[0])
    return [vx, vy, w, *(force / (MASS + added)), moment / J, *stretch]


def test_it_walks_as_an_engine_of_its_own_says(walk):
    """One second from the air, with steps of 0.1 ms, to 2 um and 20 urad."""
    start = [0, 0.13, 0, 0, 0, 0, 0, 0]
    times = np.linspace(0, 1, 11)[1:]
    found = solve_ivp(_rate, (0, 1), start, t_eval=times, rtol=1e-8, atol=1e-10, max_step=2e-3)
    q = walk(seconds=1.0, step=1e-4)[999::1000]
    np.testing.assert_allclose(q[:, :2], found.y[:2].T, atol=2e-6)
    np.testing.assert_allclose(q[:, 2], found.y[2], atol=2e-5)


def test_steps_of_a_millisecond_are_fine_enough(walk):
    """Against a twentieth of it: to 0.1 mm of 7 mm heave and 0.1 deg of pitch all along 3 s."""
    coarse, fine = walk(seconds=3.0), walk(seconds=3.0, step=5e-5)[19::20]
    np.testing.assert_allclose(coarse[:, :2], fine[:, :2], atol=1e-4)
    np.testing.assert_allclose(coarse[:, 2], fine[:, 2], atol=2e-3)


def _in_space(early=0.0):
    """The crawler with four legs of its own on a free body; cranks of the left ones are `early` [rad]."""
    data = describe("poseidrone_crawl").model_dump(exclude_unset=True)
    legs = {}
    for name in ("front", "rear"):
        one = data["body"]["loads"].pop(name)
        for side, y in (("left", 0.05), ("right", -0.05)):
            start = one["start"] + (early if side == "left" else 0.0)
            hip = (one["hip"][0], y, one["hip"][2])
            legs[f"{name}_{side}"] = {**one, "hip": hip, "start": start, "count": 1.0}
    data["body"]["loads"] |= legs
    data["body"]["joint"] = {"kind": "free", "start": {"position": (0.0, 0.0, 0.13)}}
    return build(RobotDescription.model_validate(data | {"aliases": {}}))


def test_on_a_free_body_in_space_it_walks_as_in_the_plane(walk):
    """Positions to rounding as long as it lasts; and it neither drifts aside nor rolls."""
    flat, free = walk(), walk(robot=_in_space())
    np.testing.assert_allclose(free[:, [0, 2]], flat[:, :2], atol=1e-9)
    assert np.abs(free[:, 1]).max() < 1e-12


def test_legs_of_one_side_that_step_earlier_roll_the_body(walk):
    """A quarter of a turn between the sides: it rolls by degrees, to both sides."""
    free = walk(robot=_in_space(np.pi / 2), seconds=4.0)
    w, x, y, z = free[1000:, 3:].T
    roll = np.degrees(np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)))
    assert np.ptp(roll) > 1.0
    assert np.abs(roll).max() < 45


def _turned(drive):
    """The crawler whose legs one wheel turns, without an inertia but that of its rotor."""
    data = describe("poseidrone_crawl").model_dump(exclude_unset=True)
    for name in ("front", "rear"):
        data["body"]["loads"][name] = {**data["body"]["loads"][name], "speed": None, "turned_by": "wheel"}
    hinge = {"kind": "revolute", "axis": (0.0, -1.0, 0.0), **drive}
    data["limbs"]["wheel"] = {"kind": "rigid", "shape": "point", "mass": 1e-9, "volume": 0.0, "joint": hinge}
    return build(RobotDescription.model_validate(data | {"aliases": {}}))


def test_legs_that_a_wheel_turns_evenly_walk_as_at_a_given_speed(walk):
    """In the plane; the drive of the wheel gives what legs push with and water takes."""
    wheel = _turned({"motion": {"kind": "rate", "rate": OMEGA}})
    q = walk(robot=wheel, seconds=1.0)
    np.testing.assert_allclose(q, walk(seconds=1.0), atol=1e-8)


def test_a_motor_turns_the_legs_and_their_steps_slow_it_down():
    """Speed falls below that without a load in each stance; power is accounted for at every time of the walk."""
    sheet = {"rated_voltage": 3.0, "stall_torque": 0.1, "no_load_speed": 15.0, "inertia": 1e-4}
    robot = _turned({"velocity": 15.0, "motor": {**sheet, "voltage": {"kind": "constant", "value": 3.0}}})
    data = simulate(robot, 1.0, samples=401).to_dataset()
    assert float(data["power_balance"].max()) < 1e-10
    speed, work = data["motor_rate"].values[:, 0], (data["motor_torque"] * data["motor_rate"]).values[:, 0]
    assert speed[200:].min() < 12.0 < 14.0 < speed[200:].max() < 16.0
    np.testing.assert_allclose(data["electrical_power"].values[:, 0], work + data["motor_heat"].values[:, 0], rtol=1e-9)


def test_without_a_floor_it_only_sculls_and_sinks(walk):
    """It falls, until drag carries its weight: 31.8 v^2 = W, and little by its legs."""
    data = describe("poseidrone_crawl", [*STILL]).model_dump(exclude_unset=True)
    data["water"].pop("floor")
    q = walk(robot=build(RobotDescription.model_validate(data)), seconds=6.0)
    assert (q[-2, 1] - q[-1, 1]) / 1e-3 == pytest.approx(np.sqrt(WEIGHT / 31.8), rel=0.02)


def test_it_moves_in_a_plane():
    assert moves_in_plane(build(describe("poseidrone_crawl")))


def test_a_crank_that_reaches_its_bearing_is_refused():
    with pytest.raises(InputError, match="the crank reaches its bearing"):
        describe("poseidrone_crawl", ["body.loads.front.bearing.1=-10 mm"])

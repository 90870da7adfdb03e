"""What a cycle gives, against closed forms on states that are known; derivatives; batches; labels."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import DRIVEN, M0, C, F, I, K

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import bind, build
from nectosome.robots import describe
from nectosome.solve import CycleMeans, Periodic, Trajectory, cycle_means, mean_data
from nectosome.solve.motor_results import MOTOR_VARIABLES
from nectosome.solve.results import TENDON_VARIABLES

from .conftest import ROWING

means_of = jax.jit(cycle_means)


def samples(period: float, n: int = 129) -> jax.Array:
    return jnp.linspace(0.0, period, n)


def test_a_driven_oscillator_burns_half_c_w2_x2():
    """P = C w^2 X^2 / 2 = what the torque gives; mean kinetic energy I w^2 X^2 / 4; the root stays where it is."""
    w = 2 * np.pi * F
    X = M0 / (K - I * w**2 + 1j * C * w)
    times = samples(1 / F, 33)
    answer = X * jnp.exp(1j * (w * times + 0.4 - jnp.pi / 2))
    robot = build(parse_robot(DRIVEN))
    states = State(answer.real[:, None], (1j * w * answer).real[:, None], robot.initial().z)
    means = means_of(robot, times, states)
    burnt = C * w**2 * abs(X) ** 2 / 2
    assert float(means.power) == pytest.approx(burnt, rel=1e-12)
    # M V cos(a) cos(a + d) is positive in a share of the cycle only
    d = np.angle(1j * X)
    given = M0 * w * abs(X) / (2 * np.pi) * ((np.pi - abs(d)) * np.cos(d) + np.sin(abs(d)))
    assert float(means.power_positive) == pytest.approx(given, rel=5e-3) and given > 1.02 * burnt
    data, names = mean_data(robot, means)
    power = dict(zip(names["load"][1], data["load_power"][1][:, 0], strict=True))
    assert power["drive"] == pytest.approx(burnt, rel=1e-12)
    assert power["damper"] == pytest.approx(-burnt, rel=1e-12)
    assert power["spring"] == pytest.approx(0, abs=1e-12 * burnt)
    assert float(means.energy[0]) == pytest.approx(I * w**2 * abs(X) ** 2 / 4, rel=1e-12)
    assert (float(means.speed), float(means.turn_rate)) == pytest.approx((0, 0), abs=1e-12)
    assert np.isnan(means.cost_of_transport)
    assert np.isnan(means.efficiency)


def test_a_rigid_plate_that_strokes_evenly_gives_no_thrust_and_burns_what_drag_takes():
    """P = rho w Cn/8 (r2^4 - r1^4) mean |b'|^3 with mean |A w cos|^3 = 4 (A w)^3 / 3 pi, all of it drag's."""
    A, f, r1, r2 = np.radians(60), 0.7, 0.105, 0.210
    robot = build(describe("paddle", ["N=0", "A=60deg", "f=0.7Hz"]))
    still = robot.initial()
    n = 513
    states = State(jnp.zeros((n, still.q.size)), jnp.zeros((n, still.v.size)), still.z)
    means = means_of(robot, samples(1 / f, n), states)
    across, torque = means.reaction[1], means.reaction[3]
    assert (float(across), float(torque)) == pytest.approx((0, 0), abs=1e-9)
    fastest = A * 2 * np.pi * f
    burnt = 1000 * 0.040 / 8 * (r2**4 - r1**4) * 4 * fastest**3 / (3 * np.pi)
    assert float(means.power) == pytest.approx(burnt, rel=1e-8)
    assert float(jnp.sum(means.load_power)) == pytest.approx(-burnt, rel=1e-8)
    assert float(means.drive_velocity_peak[3]) == pytest.approx(fastest, rel=1e-12)
    assert float(means.load_power_peak.max()) == pytest.approx(burnt * 3 * np.pi / 4, rel=1e-8)  # at the fastest


THRUSTER = """
name: thruster
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 0.2 m
  radius: 0.05 m
  mass: 2 kg
  joint:
    kind: planar
    axis: z
    drive: {x: {kind: constant, value: 3 N}}
  loads: {drag: {kind: lumped_drag, drag_area: [4e-3 m2, 4e-3 m2, 0 m2]}}
"""


def course(robot, times, path):
    """Course of cycles in which the root of a planar robot goes along a path (x, y, angle)."""
    place = jnp.stack([g(times) for g in path], axis=1)
    cycle = Trajectory(robot, times, State(place, 0 * place, robot.initial().z))
    none = np.zeros(0)
    return Periodic(cycle, jnp.asarray(0), {}, jnp.zeros(()), multipliers=none, multiplier_errors=none).course()


def test_a_body_that_goes_straight_and_one_that_goes_round():
    """Straight: P = F V, efficiency rho CdA V^2 / 2F, cost F/mg. Round: the chord over T, the heading over T."""
    robot, times = build(parse_robot(THRUSTER)), samples(2.0, 17)

    def means(x, y, angle):
        place = jnp.stack([x(times), y(times), angle(times)], axis=1)
        rates = jnp.stack([jax.vmap(jax.grad(g))(times) for g in (x, y, angle)], axis=1)
        return means_of(robot, times, State(place, rates, robot.initial().z))

    V, force = 0.8, 3.0
    straight = means(lambda t: V * t, lambda t: 0 * t, lambda t: 0 * t)
    assert float(straight.speed) == pytest.approx(V, rel=1e-12)
    assert float(straight.power) == pytest.approx(force * V, rel=1e-12)
    assert float(straight.efficiency) == pytest.approx(1000 / 2 * 4e-3 * V**2 / force, rel=1e-12)
    assert float(straight.cost_of_transport) == pytest.approx(force / (2 * 9.80665), rel=1e-12)
    assert float(straight.turn_rate) == pytest.approx(0, abs=1e-15)
    # the body's centre is 0.1 m ahead of its joint
    turn, radius = -0.6, V / 0.6
    circle = (
        lambda t: radius * jnp.cos(turn * t) - 0.1 * jnp.cos(turn * t),
        lambda t: radius * jnp.sin(turn * t) - 0.1 * jnp.sin(turn * t),
        lambda t: turn * t,
    )
    round_ = means(*circle)
    assert float(round_.turn_rate) == pytest.approx(turn, rel=1e-12)
    assert float(round_.speed) == pytest.approx(2 * radius * np.sin(0.6) / 2, rel=1e-12)
    turns = course(robot, times, circle)
    assert (turns.radius, turns.rate) == pytest.approx((radius, 0.6), rel=1e-10)
    assert turns.axis == pytest.approx([0, 0, -1], abs=1e-12)
    assert turns.pitch == pytest.approx(0, abs=1e-12)
    goes_straight = course(robot, times, (lambda t: V * t, lambda t: 0 * t, lambda t: 0 * t))
    assert (goes_straight.radius, goes_straight.rate) == (np.inf, 0)
    assert goes_straight.axis == pytest.approx([1, 0, 0], abs=1e-12)
    pushed = build(parse_robot(THRUSTER.replace("loads: {", "loads: {push: {kind: force, force: [1 N, 0 N, 0 N]}, ")))
    place, rates = jnp.stack([V * times, 0 * times, 0 * times], axis=1), jnp.tile(jnp.array([V, 0.0, 0.0]), (17, 1))
    given = means_of(pushed, times, State(place, rates, pushed.initial().z))
    assert float(given.power) == pytest.approx(force * V, rel=1e-12)
    assert np.isnan(given.efficiency)  # what a given force takes is not known
    assert np.isnan(given.cost_of_transport)
    nowhere = jnp.zeros((times.size, 3))
    held = means_of(robot, times, State(nowhere, nowhere, robot.initial().z))
    assert np.isnan(held.cost_of_transport)
    assert np.isnan(held.efficiency)


STOP = """
      stiffness: 0.03 N m/rad
      lower: {stiffness: 10 N m/rad, damping: 0.01 N m s/rad}"""
LAYER = "\n      flexure: {as_printed: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}"
FIN = (
    ROWING.replace("{kind: prismatic, axis: y}", "{kind: planar, axis: z}")
    .replace("[0 m2, 4e-3 m2, 0 m2]", "[4e-3 m2, 8e-3 m2, 0 m2]")
    .replace("amplitude: 60 deg", "amplitude: 40 deg")
    .replace(STOP, LAYER)
)
PATHS = ("limbs.arm.joint.motion.amplitude", "limbs.blade.joint.flexure.young", "body.mass")


@pytest.fixture(scope="module")
def fin():
    """Means of the fin as a function of its numbers and states, and a place and a direction to go from there."""
    theta, build_at = bind(parse_robot(FIN), PATHS)
    robot = build_at(theta)
    times = samples(1.25, 17)
    rng = np.random.default_rng(3)
    w = 2 * np.pi / 1.25 * jnp.array([1, 2])[:, None]
    angle = w * times + jnp.array([0.3, 1.1])[:, None]  # no two peaks are of the same height
    waves = jnp.asarray(0.3 * rng.normal(size=(4, 2)))
    drift = jnp.array([-0.2, 0.05, 0.1, 0.0])
    q, v = (waves @ jnp.sin(angle)).T, (waves @ (w * jnp.cos(angle))).T
    x = State(q + times[:, None] * drift, v + drift, robot.initial().z)
    along = State(jnp.asarray(0.1 * rng.normal(size=q.shape)), jnp.asarray(0.1 * rng.normal(size=v.shape)), x.z)
    direction = jnp.array([0.2, 1e5, 0.1]), along

    def means(theta, x) -> CycleMeans:
        return cycle_means(build_at(theta), times, x)

    return robot, means, (theta, x), direction


def test_derivatives_are_those_of_finite_differences_and_what_has_no_value_spoils_none(fin):
    """In a batch of three, here, ahead and behind."""
    _, means, place, direction = fin
    h, still = 1e-5, ("energy", "body_length", "water_velocity")  # what none of the three changes
    places = jax.tree.map(lambda a, b: jnp.stack([a, a + h * b, a - h * b]), place, direction)
    values, slopes = jax.jit(jax.vmap(lambda *p: jax.jvp(means, p, direction)))(*places)
    for name, value, slope in zip(
        CycleMeans._fields, *(jax.tree.map(np.asarray, m) for m in (values, slopes)), strict=True
    ):
        _, ahead, behind = value
        there = ~np.isnan(ahead)
        difference = ((ahead - behind) / (2 * h))[there]
        assert not difference.size or np.abs(difference).max() > 1e-6 or name in still, name
        scale = np.abs(difference).max(initial=1e-9)
        np.testing.assert_allclose(slope[0][there], difference, rtol=0, atol=2e-6 * scale, err_msg=name)
    assert np.isnan(values.hinge_stress_peak[0]).tolist() == [True, True, False]
    assert np.isnan(values.bending_strain_peak).all()


@pytest.mark.slow
def test_derivatives_backward_are_those_forward(fin):
    _, means, place, direction = fin

    def judged(*place) -> jax.Array:
        m = means(*place)
        return m.efficiency + m.cost_of_transport + m.turn_rate + m.hinge_stress_peak[2] / 1e5

    forward = jax.jit(lambda p, d: jax.jvp(judged, p, d)[1])(place, direction)
    back = jax.jit(jax.grad(judged, argnums=(0, 1)))(*place)
    along = sum(jnp.vdot(a, b) for a, b in zip(jax.tree.leaves(back), jax.tree.leaves(direction), strict=True))
    assert float(along) == pytest.approx(float(forward), rel=1e-9)


def test_a_batch_has_the_names_and_units_of_one_cycle(fin):
    robot, means, place, _ = fin
    one = jax.eval_shape(means, *place)
    data, names = mean_data(robot, jax.tree.map(lambda x: np.ones(x.shape), one))
    many, same = mean_data(robot, jax.tree.map(lambda x: np.ones((5, *x.shape)), one), ("lane",))
    absent = MOTOR_VARIABLES | TENDON_VARIABLES
    others = {name for name in CycleMeans._fields if name.removesuffix("_peak") in absent} | {"battery_endurance"}
    assert set(data) == set(CycleMeans._fields) - others and len(others) == 13
    sizes = {name: label[1].size for name, label in names.items()} | {"lane": 5}
    for name, (dims, values, unit) in many.items():
        assert (dims, unit) == (("lane", *data[name][0]), data[name][2])
        assert values.shape == tuple(sizes[dim] for dim in dims)
    assert set(same) == set(names) == {"part", "axis", "load", "prescribed", "form", "number"}


@pytest.mark.parametrize("heading", [0.0, 2.3, -1.1])
@pytest.mark.parametrize(("forward", "sign"), [("x", -1), ("-x", 1)])
def test_forward_speed_has_a_sign_and_no_heading(forward, sign, heading):
    """A body that goes backwards at V, whatever its heading; it goes with a slip angle b: V cos b ahead."""
    robot, times = build(parse_robot(THRUSTER.replace("body:", f"forward: {forward}\nbody:"))), samples(2.0, 17)
    V, slip = 0.8, 0.3
    course = heading + slip
    place = jnp.outer(times, -V * jnp.array([jnp.cos(course), jnp.sin(course), 0.0])) + jnp.array([0, 0, heading])
    rates = jnp.tile(-V * jnp.array([jnp.cos(course), jnp.sin(course), 0.0]), (17, 1))
    means = means_of(robot, times, State(place, rates, robot.initial().z))
    assert float(means.speed) == pytest.approx(V, rel=1e-12)
    assert float(means.forward_speed) == pytest.approx(sign * V * np.cos(slip), rel=1e-12)


def test_a_body_that_wags_goes_along_its_mean_axis_and_one_that_turns_over_along_none():
    """Wagging evenly about its course it goes ahead at V, though it never points there; a whole turn a cycle: NaN."""
    robot, times = build(parse_robot(THRUSTER)), samples(1.0, 33)
    joint = 0.1  # of the body's centre ahead of it [m]

    def forward_speed(angle):
        place = jnp.stack([-0.5 * times - joint * jnp.cos(angle(times)), -joint * jnp.sin(angle(times)), angle(times)])
        return means_of(robot, times, State(place.T, 0 * place.T, robot.initial().z)).forward_speed

    wags = forward_speed(lambda t: 0.6 * jnp.cos(2 * jnp.pi * t))
    assert float(wags) == pytest.approx(-0.5, rel=1e-12)
    assert np.isnan(forward_speed(lambda t: 2 * jnp.pi * t))

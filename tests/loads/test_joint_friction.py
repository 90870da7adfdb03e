"""Dry friction of joints: what is below it is held, what is above slides by Coulomb's law, and the account closes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from nectosome.core import Status
from nectosome.description import parse_robot, with_values
from nectosome.model import bind, build
from nectosome.solve import modes, periodic, simulate, static

F, INERTIA, SLIP = 0.2, 1e-3, np.deg2rad(0.1)  # N m, kg m2, rad
ARM = f"""
name: arm
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 0.1 kg
  volume: 0 m3
  inertia: [{INERTIA} kg m2, {INERTIA} kg m2, {INERTIA} kg m2]
  joint: {{kind: revolute, axis: z, friction: {F} N m, stiffness: 0 N m/rad, damping: 0 N m s/rad,
    torque: {{kind: sine, amplitude: 0 N m, frequency: 2 Hz, offset: 0 N m}}}}
aliases: {{torque: body.joint.torque.offset, shaken: body.joint.torque.amplitude, friction: body.joint.friction}}
"""
DESCRIBED = parse_robot(ARM)


def angles(time: float, samples: int = 31, **values) -> np.ndarray:
    return np.asarray(simulate(build(with_values(DESCRIBED, values)), time, samples=samples).to_dataset()["q"])[:, 0]


@pytest.mark.parametrize("share", [0.3, 0.5, 0.8])
def test_a_hinge_holds_what_is_below_its_friction(share: float):
    """For 30 s: put on at once it gives way by no more than s int 2 w dw/(1 - w^9), twice what it does slowly."""
    angle = angles(30.0, torque=share * F)
    assert share * SLIP * 0.999 < angle[-1] < 2 * share * SLIP
    assert np.ptp(angle[10:]) < 0.01 * SLIP


def test_loads_to_and_fro_do_not_walk_it_off():
    """60 times between 0.2 and 0.8 of its friction, each by at most s int 2 w^9/(1 - w^18) dw = 0.03 s."""
    angle = angles(30.0, samples=61, torque=0.5 * F, shaken=0.3 * F)
    assert angle[-1] - angle[2] < 60 * 0.03 * SLIP < np.deg2rad(0.2)


def test_above_its_friction_the_rest_accelerates_it():
    """(T - F)/I, whatever the speed."""
    speed = np.diff(angles(1.0, torque=-2 * F)[15:]) * 30
    np.testing.assert_allclose(np.diff(speed) * 30, -F / INERTIA, rtol=1e-4)


SPRING = {"body.joint.stiffness": 4.0, "body.joint.position": 1.0}
SWINGING = build(with_values(DESCRIBED, SPRING))


@pytest.fixture(scope="module")
def swing():
    return simulate(SWINGING, 1.5, samples=12001, rtol=1e-5, atol=1e-8).to_dataset()


def test_a_swing_loses_twice_friction_over_stiffness_each_half_cycle_and_stays_where_it_is_held(swing):
    """The peaks fall by 2 F/k, less what its presliding saves, at most 2 s each; then it stays off the middle."""
    q, v = (np.asarray(swing[name])[:, 0] for name in ("q", "v"))
    peaks = np.abs(q[1:][v[1:] * v[:-1] < 0])[:9]
    fall = -np.diff(np.concatenate([[1.0], peaks]))
    assert np.all((fall > 2 * F / 4 - 2 * SLIP) & (fall < 2 * F / 4 + 1e-4))  # samples miss a peak by less
    assert 1e-3 < abs(q[-1]) < F / 4 and np.ptp(q[-1000:]) < 1e-3 * SLIP
    assert float(swing["power_balance"].max()) < 1e-12


def test_what_friction_takes_is_what_the_swing_loses(swing):
    """k (x0^2 - x^2)/2 of its spring."""
    q, power = np.asarray(swing["q"])[:, 0], np.asarray(swing["load_power"].sel(load="joint_friction")).ravel()
    assert -np.trapezoid(power, swing["time"]) == pytest.approx(2 * (1 - q[-1] ** 2), rel=1e-4)
    given_back = np.trapezoid(np.maximum(power, 0.0), swing["time"])
    assert given_back < 11 * F * SLIP / 2  # what it has stored at each of the turns


def test_one_equilibrium_is_without_friction_and_a_long_time_ends_there():
    """What is held off it creeps there, by s F/k in 10,000 s; where nothing else holds the joint there is none."""
    robot = build(with_values(DESCRIBED, {**SPRING, "body.joint.position": 0.03, "torque": 0.04}))
    found = static(robot)
    assert float(found.state.q[0]) == pytest.approx(0.01, rel=1e-12)
    assert any("dry friction" in note for note in found.notes)
    run = simulate(robot, 1e7, samples=5).to_dataset()
    assert float(run["q"][-1, 0]) == pytest.approx(0.01, abs=1e-9)
    loose = static(build(with_values(DESCRIBED, {"torque": 0.5 * F})))
    assert int(loose.status) == Status.NO_EQUILIBRIUM
    assert "dry friction may hold it" in loose.why


def test_small_motions_are_those_of_what_is_held():
    """As by a spring F/s: (k + F/s)/I."""
    values = modes(SWINGING).eigenvalue
    assert np.max(np.abs(values)) ** 2 == pytest.approx((4 + F / SLIP) / INERTIA, rel=1e-6)


def test_derivatives_through_slides_and_turns_are_those_of_finite_differences():
    """Of two in a batch, one of which turns back twice."""
    theta, make = bind(SWINGING, ("body.joint.friction",))

    @jax.jit
    @jax.vmap
    def end(x):
        value = lambda x: simulate(make(x), 0.2, samples=2, rtol=1e-9, atol=1e-11).value.state.q[-1, 0]  # noqa: E731
        return jax.jvp(value, (x,), (jnp.ones(1),))

    _, slope = end(jnp.stack([theta, 3 * theta]))
    (low, high), _ = end(jnp.stack([theta - 1e-4, theta + 1e-4]))
    assert float(slope[0]) == pytest.approx(float(high - low) / 2e-4, rel=1e-4)
    (low, high), _ = end(jnp.stack([3 * theta - 1e-4, 3 * theta + 1e-4]))
    assert float(slope[1]) == pytest.approx(float(high - low) / 2e-4, rel=1e-4)


def test_a_cycle_is_found_and_gives_friction_what_its_loop_encloses():
    """Driven by a torque: mean power of the drive = that of friction, 4 F X f less what presliding saves."""
    driven = with_values(DESCRIBED, {**SPRING, "body.joint.position": 0.0, "body.joint.velocity": 0.0, "shaken": 1.0})
    found = periodic(build(driven))
    assert int(found.status) == Status.SOLVED
    data = found.to_dataset()
    X = 0.5 * float(np.ptp(data["q"].values))
    power = -float(np.mean(data["load_power"].sel(load="joint_friction").values[..., :-1, :]))
    assert 4 * F * (X - SLIP) * 2 < power < 4 * F * X * 2


SLOPE = """
name: block
water: {density: 1000 kg/m3}
body: {kind: rigid, shape: point, mass: 2 kg, volume: 0 m3,
  joint: {kind: prismatic, axis: [4, 0, -3], friction: 20 N}}
"""


def test_a_block_stays_on_a_slope_below_its_friction_and_slides_above():
    """m g sin a = 11.77 N of 20 N hold; of 10 N, (m g sin a - F)/m is left."""
    pull, block = 2 * 9.80665 * 0.6, parse_robot(SLOPE)
    stays = np.asarray(simulate(build(block), 30.0, samples=5).to_dataset()["q"])[:, 0]
    slides = simulate(build(with_values(block, {"body.joint.friction": 10.0})), 2.0, samples=5).to_dataset()["q"]
    assert pull / 20 * 1e-4 * 0.99 < stays[-1] < 2e-4 and np.ptp(stays[1:]) < 1e-6
    assert float(np.diff(np.asarray(slides)[:, 0], 2)[-1]) / 0.25 == pytest.approx((pull - 10) / 2, rel=1e-4)


RUBBED = """
name: rubbed
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: point, mass: 1 kg, volume: 0 m3,
   joint: {kind: prismatic, axis: x, friction: 2 N, stiffness: 30 N/m,
           force: {kind: sine, amplitude: 5 N, frequency: 1.1 Hz}}}
"""


def test_a_cycle_that_dry_friction_reverses_in_has_derivatives_at_any_tolerance():
    """Where it reverses, rates of derivatives jump; by the friction, as another integrator has it of the same law."""
    theta, make = bind(parse_robot(RUBBED), ("body.joint.friction",))
    turn, period = 2 * np.pi * 1.1, 1 / 1.1

    def start(friction):
        found = periodic(make(friction[None]), jnp.asarray(period), samples=3, rtol=1e-7, atol=1e-9)
        return found.value.state.q[0, 0]

    def rate(t, y, friction):
        x, v, w = y
        slip = 100 * v  # over 0.1 mm, in 0.01 s
        force = friction * (w + 0.5 * (1 - w * w) * slip / np.hypot(1, slip))
        return [v, 5 * np.sin(turn * t) - 30 * x - force, 1e4 * (v - abs(v) * w**9) - 1e-4 * w]

    def settled(friction):
        y = np.array([-0.12094, -1.4507, -1.0])  # close to the cycle
        for _ in range(25):
            y = solve_ivp(
                rate, (0, period), y, args=(friction,), method="LSODA", rtol=1e-8, atol=1e-11, max_step=0.02
            ).y[:, -1]
        return y[0]

    at, own = jax.jit(lambda friction: jax.jvp(start, (friction,), (jnp.ones(()),)))(jnp.asarray(theta[0]))
    assert float(at) == pytest.approx(settled(2.0), abs=2e-5)
    assert float(own) == pytest.approx((settled(2.02) - settled(1.98)) / 0.04, rel=5e-3)

"""Derivatives of periodic motions against closed forms, and against differences of motions found side by side."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import DRIVEN

from nectosome.core import State, Status
from nectosome.description import parse_robot, with_values
from nectosome.mechanism.reduce import in_plane
from nectosome.model import bind
from nectosome.robots import describe
from nectosome.solve import find_symmetry
from nectosome.solve.integrate import Settings
from nectosome.solve.orbit import orbit
from nectosome.solve.sensitivity import allowed_sensitivity

SHARES = jnp.linspace(0.0, 1.0, 129)  # of the period


def cycle_of(description, paths):
    """Numbers theta of a description, the third of which is the frequency, and its cycle at theta."""
    theta, make = bind(description, paths)
    symmetry = find_symmetry(make(theta))

    def at(theta, rtol):
        robot, times = make(theta), SHARES / theta[2]
        settings = Settings("implicit", rtol, 1e-2 * rtol, jnp.asarray(100_000), longest=times[-1] / 100)
        found = orbit(in_plane(robot), symmetry, robot.initial(), times, settings)
        return robot, times, found

    return theta, at


def one_by_one(states):
    return jax.vmap(jax.jacfwd(states))


def all_at_once(states):
    return lambda thetas: jax.jacfwd(lambda d: jax.vmap(states)(thetas + d))(jnp.zeros(4))


@pytest.mark.parametrize("slopes_of", [one_by_one, pytest.param(all_at_once, marks=pytest.mark.slow)])
def test_driven_oscillators_have_the_slopes_of_their_transfer_function(driven, slopes_of):
    """theta = Re M e^{i w t} / (K - I w^2 + i C w), at times that keep their shares of the period 2 pi / w."""
    names = ("stiffness", "damping", "torque.frequency", "torque.amplitude")
    theta, cycle = cycle_of(driven, tuple(f"body.joint.{name}" for name in names))

    def states(theta):
        x = cycle(theta, jnp.asarray(1e-9))[2].value.states
        return x.q[:, 0], x.v[:, 0]

    def closed_form(theta):
        K, C, F, M = theta
        w = 2 * jnp.pi * F
        x = M / (K - 0.02 * w**2 + 1j * C * w) * jnp.exp(1j * (2 * jnp.pi * SHARES + 0.4 - jnp.pi / 2))
        return x.real, (1j * w * x).real

    thetas = theta * jnp.array([[1.0, 1.0, 1.0, 1.0], [2.0, 0.7, 1.1, 1.0]])
    for found, wanted in zip(jax.jit(slopes_of(states))(thetas), one_by_one(closed_form)(thetas), strict=True):
        error = np.abs(found - wanted).max(axis=1) / np.abs(wanted).max(axis=1)
        assert error.max() < 1e-7


def test_what_begins_to_count_in_the_middle_of_a_cycle_has_slopes():
    """The stiffness of a stop counts from the touch on: its sensitivity leaves 0 within a step."""
    joint = "    stiffness:"
    stop = "    upper: {at: 0.04 rad, stiffness: 5 N m/rad, softness: 0.5 deg}\n"
    stopped = parse_robot(DRIVEN.replace(joint, stop + joint))
    theta, cycle = cycle_of(stopped, ("body.joint.upper.stiffness", "body.joint.damping", "f"))

    def angles(stiffness, rtol):
        x = cycle(theta.at[0].set(stiffness), rtol)[2].value.states.q[:, 0]
        return x, x

    program = jax.jit(jax.jacfwd(angles, has_aux=True))
    at, h, rtol = theta[0], 1e-3 * theta[0], jnp.asarray(1e-9)
    quotients = (program(at + h, rtol)[1] - program(at - h, rtol)[1]) / (2 * h)
    np.testing.assert_allclose(program(at, rtol)[0], quotients, atol=1e-5 * np.abs(quotients).max())


def mean_thrust(robot, times, states):
    """Mean force of the water along -y [N]."""

    def at(t, x):
        acting = robot.forces(t, x, jnp.zeros_like(x.v))
        return -jnp.sum(acting.shape.rotation[:, 1] * robot.on_stations(acting.wrenches)[:, 3:])

    return jnp.mean(jax.vmap(at)(times, states)[1:])


def mean_speed(_, times, states):
    return (states.q[-1, 0] - states.q[0, 0]) / times[-1]


def compare(description, paths, measure, steps):
    """Slopes of a measure at rtol 1e-8 and its central differences at 1e-10 agree to 1e-5, and so do the latter.

    `steps` are relative to the numbers: longer ones feel the curvature, shorter ones the errors of the motions.
    """
    theta, cycle = cycle_of(description, paths)

    def value(theta, rtol):
        robot, times, found = cycle(theta, rtol)
        one = measure(robot, times, found.value.states)
        return one, (one, found.status)

    program = jax.jit(jax.jacfwd(value, has_aux=True))

    def at(theta):
        _, (one, status) = program(theta, jnp.asarray(1e-10))
        assert int(status) == Status.SOLVED
        return float(one)

    slopes, _ = program(theta, jnp.asarray(1e-8))
    for step in steps:
        moves = step * jnp.diag(theta)
        quotients = [(at(theta + e) - at(theta - e)) / (2 * float(e[k])) for k, e in enumerate(moves)]
        np.testing.assert_allclose(slopes, quotients, rtol=1e-5)


PADDLE = ("limbs.segment1.joint.flexure.young", "A", "f")


@pytest.mark.slow
def test_the_slopes_of_a_paddles_thrust_are_those_of_differences():
    """Its hinge closes and opens its stop in each cycle."""
    compare(describe("paddle", ["N=1"]), PADDLE, mean_thrust, [1e-4])


@pytest.mark.slow
def test_the_slopes_of_three_segments_are_those_of_differences():
    compare(describe("paddle", ["N=3"]), PADDLE, mean_thrust, [1e-5, 3e-5])


@pytest.mark.slow
def test_a_drive_whose_acceleration_jumps_at_shares_of_the_period_has_right_slopes():
    uneven = with_values(describe("paddle", ["N=1"]), {"limbs.arm.joint.motion.forward_share": 0.4})
    compare(uneven, PADDLE, mean_thrust, [2e-4, 4e-4])


@pytest.mark.slow
def test_the_slopes_of_a_boats_speed_are_those_of_differences(boat):
    """Its place drifts."""
    stroke = "limbs.arm.joint.motion"
    paths = ("limbs.blade.joint.stiffness", f"{stroke}.amplitude", f"{stroke}.frequency")
    compare(boat, paths, mean_speed, [1e-3, 5e-4])


def test_slopes_that_are_next_to_nothing_may_err_by_a_share_of_the_others():
    """Else rounding errors of what does not change would ask for ever smaller steps."""
    still = State(jnp.array([[1.0, 0.0], [0.0, 0.0]]), jnp.array([[0.0, 1e-18], [0.0, 2.0]]), ())
    allowed = allowed_sensitivity(jnp.asarray(1e-3), 0.0, still, still)
    np.testing.assert_allclose(allowed.q[0], 1e-3)
    np.testing.assert_allclose(allowed.v[0], 1e-9)
    np.testing.assert_allclose(allowed.q[1], 2e-9)
    np.testing.assert_allclose(allowed.v[1], 2e-3)

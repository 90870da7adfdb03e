"""Derivatives with respect to a robot's description, forward through `build`, against differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.model import bind
from nectosome.solve.integrate import Settings, begin, integrate

PATHS = (
    "L",
    "E",
    "tip_radius",
    "alpha",
    "omega",
    "limbs.filament.density",
    "water.density",
    "limbs.hook.loads.drag.lift",
)


def difference(f, theta, k):
    """Central difference, extrapolated: error of fourth order in the step."""

    def at(share):
        step = share * abs(float(theta[k])) * np.eye(theta.size)[k]
        return (np.asarray(f(theta + step)) - np.asarray(f(theta - step))) / (2 * share * abs(float(theta[k])))

    return (4 * at(5e-4) - at(1e-3)) / 3


@pytest.fixture(scope="module")
def bound(propeller):
    return bind(propeller, PATHS, log=("E",))


@pytest.fixture(scope="module")
def slopes_of_the_residual(bound, propelled, some_state):
    theta, from_theta = bound
    x, a = some_state(propelled, 1, 0.1)

    def residual(theta):
        return from_theta(theta).residual(jnp.asarray(0.3), x, a)

    return theta, jax.jit(residual), jax.jit(jax.jacfwd(residual))(theta)


@pytest.mark.parametrize("k", range(len(PATHS)), ids=PATHS)
def test_of_the_residual(slopes_of_the_residual, k):
    theta, residual, slopes = slopes_of_the_residual
    wanted = difference(residual, theta, k)
    assert np.max(np.abs(wanted)) > 0
    np.testing.assert_allclose(slopes[:, k], wanted, atol=1e-7 * np.max(np.abs(wanted)))


def test_of_the_end_of_a_pendulums_run(pendulum):
    check_the_end_of_a_run(pendulum, ("body.length", "body.height", "water.gravity"), 1.0)


@pytest.mark.slow
def test_of_the_end_of_a_propellers_run(propeller):
    check_the_end_of_a_run(propeller, PATHS, 0.03)


def check_the_end_of_a_run(description, paths, duration):
    """Through an adaptive implicit run, its Newton iterations and step sizes; compiled once for all paths."""
    theta, from_theta = bind(description, paths, log=("E",) if "E" in paths else ())
    settings = Settings("implicit", jnp.asarray(1e-8), jnp.asarray(1e-10), jnp.asarray(5000))

    @jax.jit
    def end_and_slope(theta, along):
        return jax.jvp(end, (theta,), (along,))

    def end(theta):
        robot = from_theta(theta)
        m = begin(jnp.zeros(()), robot.initial(), settings, jnp.asarray(1e-4))
        _, x = integrate(robot, m, jnp.array([duration]), settings)
        return jnp.concatenate([x.q[0], x.v[0]])

    for k, along in enumerate(jnp.eye(len(paths))):
        _, slope = end_and_slope(theta, along)
        wanted = difference(lambda theta, along=along: end_and_slope(theta, along)[0], theta, k)
        for found, right in zip(np.split(slope, 2), np.split(wanted, 2), strict=True):  # coordinates, velocities
            np.testing.assert_allclose(found, right, atol=1e-4 * np.max(np.abs(right)), err_msg=paths[k])

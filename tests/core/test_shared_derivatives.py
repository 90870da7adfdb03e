"""Directions of one point share what is computed of it, and derivatives are those of one by one."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core.shared_derivatives import along

asked = []


def _slopes(here, changes):
    """Derivatives of sin(a x) along k changes of x."""
    a, x = here
    asked.append(changes.shape)
    return a * jnp.cos(a * x) * changes


@jax.custom_jvp
def _wave(x):
    return jnp.sin(3.0 * x)


@_wave.defjvp
def _(primals, tangents):
    return _wave(*primals), along(_slopes, (jnp.asarray(3.0), *primals), *tangents)


X = np.array([0.1, -0.4, 0.7])


def test_all_directions_at_one_point_are_asked_for_at_once():
    asked.clear()
    J = jax.jacfwd(_wave)(X)
    assert asked[1:] == [(3, 3)]  # first it is traced with one
    np.testing.assert_allclose(J, np.diag(3 * np.cos(3 * X)), rtol=1e-14)


@pytest.mark.parametrize("points", [1, 4])
def test_points_side_by_side_have_their_own_directions(points):
    x = X + np.arange(points)[:, None]
    asked.clear()
    J = jax.vmap(jax.jacfwd(_wave))(x)
    assert asked[1:] == [(3, 3)]
    np.testing.assert_allclose(J, 3 * np.cos(3 * x)[:, :, None] * np.eye(3), rtol=1e-13)


def test_a_direction_for_each_point():
    x = np.stack([X, 2 * X])
    _, dx = jax.vmap(lambda x, d: jax.jvp(_wave, (x,), (d,)))(x, 0.5 * x)
    np.testing.assert_allclose(dx, 3 * np.cos(3 * x) * 0.5 * x, rtol=1e-14)

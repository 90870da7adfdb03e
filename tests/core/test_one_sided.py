"""The one-sided law: the depth of a force is its inverse, at every force and with its derivative."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core.one_sided import depth_of_force, one_sided_energy, one_sided_force

K, D = 2e4, 1e-4  # N/m, m


def force(depth):
    return one_sided_force(depth, jnp.zeros(()), jnp.asarray(K), jnp.zeros(()), jnp.asarray(D))


def depth(f):
    return depth_of_force(f, jnp.asarray(K), jnp.asarray(D))


@pytest.mark.parametrize("f", [1e-6, 1e-3, 0.2, 0.999, 1.0, 1.001, 50.0])
def test_the_depth_of_a_force_gives_that_force(f):
    """K D/2 = 1 N is reached at the depth D; the derivative is that of the inverse function."""
    x, slope = jax.value_and_grad(depth)(jnp.asarray(f))
    assert float(force(x)) == pytest.approx(f, rel=1e-12)
    if f != 1.0:
        assert float(slope * jax.grad(force)(x)) == pytest.approx(1.0, rel=1e-9)


def test_no_force_has_no_depth_and_a_finite_derivative():
    x, slope = jax.value_and_grad(depth)(jnp.zeros(()))
    assert 0 <= float(x) < 2e-4 * D
    assert float(slope) == 0


def test_the_force_is_the_derivative_of_the_energy():
    depths = jnp.linspace(-1, 5, 25) * D
    energy = lambda x: one_sided_energy(x, jnp.asarray(K), jnp.asarray(D))  # noqa: E731
    np.testing.assert_allclose(jax.vmap(jax.grad(energy))(depths), jax.vmap(force)(depths), atol=1e-12 * K * D)

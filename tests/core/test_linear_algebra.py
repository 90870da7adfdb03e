"""Inverse of small matrices."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core.linear_algebra import generalised_inverse, inverse


@pytest.mark.parametrize("n", [1, 2, 13, 54])
def test_inverse_is_that_of_numpy(n):
    A = np.random.default_rng(n).normal(size=(n, n))
    np.testing.assert_allclose(
        jax.jit(inverse)(A), np.linalg.inv(A), rtol=1e-8, atol=1e-10 * np.abs(np.linalg.inv(A)).max()
    )


def test_badly_scaled_mass_matrices_keep_their_digits():
    """Positive definite with entries from 1e-10 to 1: A inv(A) = 1 in the scaled sense."""
    r = np.random.default_rng(0)
    root = r.normal(size=(13, 20))
    scale = np.logspace(-5, 0, 13)
    A = (root @ root.T) * scale[:, None] * scale
    unit = (A / scale[:, None] / scale) @ (np.asarray(inverse(jnp.asarray(A))) * scale[:, None] * scale)
    np.testing.assert_allclose(unit, np.eye(13), atol=1e-12)


def test_zeros_on_the_diagonal_are_pivoted_away():
    A = jnp.array([[0.0, 2.0], [4.0, 0.0]])
    np.testing.assert_allclose(inverse(A), [[0, 0.25], [0.5, 0]])


def test_a_singular_matrix_is_not_hidden():
    assert not np.all(np.isfinite(inverse(jnp.array([[1.0, 2.0], [2.0, 4.0]]))))


def test_its_derivative_is_minus_inverse_dA_inverse():
    r = np.random.default_rng(1)
    A, dA = jnp.asarray(r.normal(size=(5, 5))), jnp.asarray(r.normal(size=(5, 5)))
    B, dB = jax.jvp(inverse, (A,), (dA,))
    np.testing.assert_allclose(dB, -B @ dA @ B, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("n", "rank"), [(1, 0), (4, 2), (13, 13), (13, 12), (13, 9)])
def test_a_generalised_inverse_solves_what_can_be_solved(n, rank):
    """A G A = A, also with rows of very different size; what is not determined stays 0; else it is numpy's inverse."""
    rng = np.random.default_rng(n + rank)
    A = rng.normal(size=(n, rank)) @ rng.normal(size=(rank, n))
    A = A * 10.0 ** rng.uniform(-4, 4, size=(n, 1))
    G = np.asarray(generalised_inverse(jnp.asarray(A)))
    np.testing.assert_allclose(A @ G @ A, A, atol=1e-9 * max(np.max(np.abs(A)), 1e-300))
    assert np.sum(np.any(G != 0, axis=1)) == rank
    if rank == n:
        np.testing.assert_allclose(G, np.linalg.inv(A), rtol=1e-8, atol=1e-12 * np.max(np.abs(G)))

"""Small convex quadratic programs against their conditions of optimality."""

import numpy as np
import pytest

from nectosome.search.optimisers.gradient import minimise_quadratic


@pytest.mark.parametrize("seed", range(8))
def test_solutions_keep_the_conditions_of_optimality(seed):
    """B d + c + A^T y = 0, A d <= b, y >= 0, y (A d - b) = 0; rows of A that are zero change nothing."""
    rng = np.random.default_rng(seed)
    root, c, A = rng.normal(size=(4, 4)), rng.normal(size=4), rng.normal(size=(6, 4))
    B, b = root @ root.T + np.eye(4), rng.uniform(-0.2, 1.0, 6)
    A[2], b[2] = 0.0, 1e3
    found = minimise_quadratic(B, c, A, b)
    assert found is not None
    d, y = found
    np.testing.assert_allclose(B @ d + c + A.T @ y, 0, atol=1e-9)
    assert np.all(A @ d <= b + 1e-9)
    assert np.all(y >= 0)
    np.testing.assert_allclose(y * (A @ d - b), 0, atol=1e-8)


def test_a_row_without_a_direction_is_kept_or_cannot_be():
    """However near the other rows are to being kept: their largest miss was what all rows were divided by."""
    B, c, A = np.eye(2), np.array([-1.0, 0.0]), np.array([[1.0, 0.0], [0.0, 0.0]])
    d, y = minimise_quadratic(B, c, A, np.array([1 - 1e-9, 1e6]))
    np.testing.assert_allclose(d, [1 - 1e-9, 0], atol=1e-12)
    np.testing.assert_allclose(y, [1e-9, 0], atol=1e-15)
    assert minimise_quadratic(B, c, A, np.array([1.0, -1e-3])) is None


def test_a_program_that_is_inconsistent_but_for_rounding_has_no_solution():
    """Its residual's last number came to 0 exactly, and was divided by."""
    B, c = np.diag([1.773653e-2, 1.915e-5]), np.array([0.056, -0.103])
    A = np.vstack([[-0.047022, 0.080509], [-0.5964, -0.3212], [-0.596378, -0.321142], np.eye(2), -np.eye(2)])
    b = np.array([-4.99e-8, 1.8498e-8, 2.0633e-8, *4 * [3.84766904e-8]])
    assert minimise_quadratic(B, c, A, b) is None

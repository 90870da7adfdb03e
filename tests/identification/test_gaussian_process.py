"""A Gaussian process whose hyperparameters are averaged over."""

import numpy as np
import pytest
from scipy.stats import norm

from nectosome.identification import Term, gaussian_process

GRID = np.stack(np.meshgrid(*[np.linspace(0, 1, 6)] * 2, indexing="ij"), axis=-1).reshape(-1, 2)


def wavy(x: np.ndarray) -> np.ndarray:
    return np.sin(3 * x[:, 0]) * (1 + x[:, 1] ** 2)


def test_exact_values_are_met_and_smooth_functions_found_between():
    x = GRID[(GRID.sum(axis=1) * 5).round() % 2 == 0]  # like the black fields of a chessboard
    same = gaussian_process(x, wavy(x), np.zeros(len(x)), x)
    np.testing.assert_allclose(same.mean, wavy(x), atol=1e-6)
    assert same.error.max() < 1e-5
    between = gaussian_process(x, wavy(x), np.zeros(len(x)), GRID)
    wrong = np.abs(between.mean - wavy(GRID))
    assert wrong.max() < 0.1  # of 2, in corners beyond what is known
    assert np.all(wrong <= 3 * between.error + 1e-6)


def test_intervals_cover_what_they_say():
    """Functions drawn from the priors themselves, with noise: 95 % intervals hold the truth in 95 % of the cases."""
    rng, inside = np.random.default_rng(0), []
    for _ in range(400):
        size, part, lengths = np.exp(rng.normal()), 0.25 * np.exp(rng.normal()), 2 * np.exp(0.8 * rng.normal(size=2))
        r = np.sqrt(5 * np.sum(((GRID[:, None] - GRID) / lengths) ** 2, axis=-1))
        K = size**2 * (1 + part**2 * (1 + r + r**2 / 3) * np.exp(-r))
        truth = np.linalg.cholesky(K + 1e-10 * size**2 * np.eye(len(GRID))) @ rng.normal(size=len(GRID))
        known = rng.choice(len(GRID), 8, replace=False)
        noise = np.full(8, 0.05 * size)
        term = Term(size, np.ones(8), np.ones(len(GRID)))
        found = gaussian_process(GRID[known], truth[known] + noise * rng.normal(size=8), noise, GRID, [term])
        rest = np.setdiff1d(np.arange(len(GRID)), known)
        inside.append(np.mean(np.abs(found.mean - truth)[rest] <= norm.ppf(0.975) * found.error[rest]))
    assert 0.92 < np.mean(inside) < 0.97


def test_units_and_the_order_of_axes_do_not_matter():
    x, rng = GRID[::3], np.random.default_rng(3)
    noise = rng.uniform(0.01, 0.1, len(x))
    one = gaussian_process(x, wavy(x), noise, GRID)
    scaled = gaussian_process(x, 1e3 * wavy(x), 1e3 * noise, GRID)
    np.testing.assert_allclose(scaled.mean, 1e3 * one.mean, rtol=1e-9)
    np.testing.assert_allclose(scaled.error, 1e3 * one.error, rtol=1e-9)
    turned = gaussian_process(x[:, ::-1], wavy(x), noise, GRID[:, ::-1])
    np.testing.assert_allclose(turned.mean, one.mean, atol=0.02)  # draws of the lengths change places


def test_a_shape_carries_what_is_measured_elsewhere():
    """What goes with a known shape is told where the shape is large from where it is small; so are two at once."""
    x, s = GRID[GRID[:, 0] < 0.5], 1 + 10 * GRID[:, 0] ** 2
    here = s[GRID[:, 0] < 0.5]
    terms = [Term(1.0, here, s), Term(1.0, np.ones(len(x)), np.ones(len(s)))]
    found = gaussian_process(x, 0.7 * here - 0.2, np.full(len(x), 1e-4), GRID, terms)
    np.testing.assert_allclose(found.mean, 0.7 * s - 0.2, rtol=0.02)
    assert np.all(np.abs(found.mean - 0.7 * s + 0.2) < 3 * found.error + 1e-3)
    alone = gaussian_process(x, 0.7 * here - 0.2, np.full(len(x), 1e-4), GRID)
    assert np.abs(alone.mean - 0.7 * s + 0.2).max() > 0.5


def test_nothing_known_and_numbers_that_are_none():
    with pytest.raises(ValueError, match="no points"):
        gaussian_process(np.zeros((0, 2)), np.zeros(0), np.zeros(0), GRID)
    with pytest.raises(ValueError, match="finite"):
        gaussian_process(GRID[:2], np.array([1.0, np.nan]), np.zeros(2), GRID)

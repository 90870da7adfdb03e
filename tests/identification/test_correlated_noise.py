"""Intervals hold the truth as often as they say, also where the noise of one sample is like that of the last one."""

import numpy as np
import pytest
from scipy.signal import lfilter

from nectosome.measure.signals.noise import correlation_time

TIME = np.linspace(0.0, 3.0, 100)
RATES = np.column_stack([np.sin(2 * np.pi * TIME), TIME * np.cos(2 * np.pi * TIME), np.exp(-TIME)])
DRAWS = 500


def noise(phi, seed):
    """An autoregressive process of order 1 and variance 1."""
    white = np.random.default_rng(seed).normal(size=TIME.size + 200)
    return lfilter([np.sqrt(1 - phi**2)], [1.0, -phi], white)[200:]


@pytest.mark.parametrize("phi", [0.0, 0.4, 0.6])
def test_linear_fits_hold_the_truth_in_95_of_100_draws(phi):
    """Within two standard errors of the count, and 1.5 % for a variance that is itself an estimate."""
    inverse, variance = np.linalg.pinv(RATES), np.diag(np.linalg.inv(RATES.T @ RATES))
    held, times = np.zeros(3), []
    for seed in range(DRAWS):
        y = noise(phi, seed)
        left = y - RATES @ (found := inverse @ y)
        times.append(correlation_time(left, 3))
        size = np.sqrt(times[-1] * left @ left / (TIME.size - 3) * variance)
        held += np.abs(found) < 1.96 * size
    np.testing.assert_allclose(held / DRAWS, 0.95, atol=2 * np.sqrt(0.05 * 0.95 / DRAWS) + 0.015)
    assert np.mean(times) == pytest.approx((1 + phi) / (1 - phi), rel=0.15)


def test_smooth_residuals_are_not_worth_less_than_half_of_what_their_sum_says():
    """What the model lacks has no correlation time of its own: a process of near unit root has any."""
    left = np.sin(2 * np.pi * TIME / 3) + 1e-3 * noise(0.0, 0)
    assert correlation_time(left) <= correlation_time(left, 3) <= 2 * correlation_time(left)

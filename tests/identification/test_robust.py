"""Huber's loss: outliers hardly move a fit, and intervals hold the truth as often as they say."""

import numpy as np
import pytest
from scipy.special import ndtri

from nectosome.identification.fits.misfit import HUBER, Misfit, robust_error, robust_width
from nectosome.identification.robot.fit import fit_robot
from nectosome.units.ranges import Ranges

from .test_robot_fit import NOISE, TIME, C, K, angle, hinge, recording, trials_of  # noqa: F401

RATES = np.stack([np.sin(6 * TIME), np.exp(-TIME)], axis=1)


def noise(seed, share, size=20.0):
    """Normal noise of which a share is larger by a factor."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=TIME.size) * np.where(rng.random(TIME.size) < share, size, 1.0)


def test_factors_of_the_normal_distribution():
    """At a bend of 1.345 the efficiency is 0.95 (Huber 1964)."""
    x = noise(0, 0.0)
    many = ndtri((np.arange(100_000) + 0.5) / 100_000)
    assert robust_error(many) == pytest.approx(1.0, rel=1e-3)
    assert robust_width(many, HUBER) ** -2 == pytest.approx(0.95, abs=1e-3)
    assert robust_width(x, np.inf) == pytest.approx(np.sqrt(np.mean(x**2)))


@pytest.mark.parametrize("share", [0.0, 0.04])
def test_linear_fits_hold_the_truth_in_95_of_100_draws(share):
    held, off, squares = np.zeros(2), [], []
    variance = np.diag(np.linalg.inv(RATES.T @ RATES))
    box = Ranges(["a", "b"], [-10.0, -10.0], [10.0, 10.0], [])
    for seed in range(200):
        y = noise(seed, share)
        sigma = robust_error(y)
        misfit = Misfit(lambda rows: (rows @ RATES.T - y) / sigma, box, lambda _: RATES / sigma, bend=HUBER)  # noqa: B023
        found = misfit.fit(np.zeros(2)).theta
        size = sigma * robust_width((RATES @ found - y) / sigma, HUBER) * np.sqrt(variance)
        held += np.abs(found) < 1.96 * size
        off.append(found)
        squares.append(np.linalg.lstsq(RATES, y, rcond=None)[0])
    np.testing.assert_allclose(held / 200, 0.95, atol=2 * np.sqrt(0.05 * 0.95 / 200) + 0.015)
    assert np.std(off) < (0.35 if share else 1.1) * np.std(squares)


@pytest.mark.slow
def test_outliers_hardly_move_a_robot(hinge):  # noqa: F811
    """4 of 100 readings 20 times as far off: intervals hold the truth, and are narrower as the noise itself says."""
    outliers = noise(3, 0.04)
    trials = trials_of(hinge, recording(angle(K, C) + NOISE * outliers))
    found, squares = (fit_robot(hinge[0], hinge[1], trials, hinge[2], {}, bend=bend) for bend in (HUBER, None))
    assert found.errors[0] == pytest.approx(NOISE, rel=0.2)
    size = robust_error(outliers)
    narrower = size * robust_width(outliers / size, HUBER) / np.sqrt(np.mean(outliers**2))
    ends = found.identifiability.intervals(), squares.identifiability.intervals()
    for one, wide, true in zip(*ends, (K, C), strict=True):
        assert one.low < true < one.high
        assert (one.high - one.low) / (wide.high - wide.low) == pytest.approx(narrower, rel=0.15)
    assert narrower < 0.5

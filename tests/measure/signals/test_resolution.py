"""Readings of an encoder in steps, and smoothed."""

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from nectosome.measure.signals.filters import cutoff_of, smoothing_spline
from nectosome.measure.signals.noise import ROUNDED, resolution

STEP = 2 * np.pi / 4096  # of an encoder of 12 bits
TIME = np.cumsum(0.01 + 2e-4 * np.random.default_rng(0).normal(size=1250))
AMPLITUDE = np.radians(25)


def angle(t):
    return AMPLITUDE * np.sin(2 * np.pi * t)


def test_ticks_of_an_encoder_are_smoothed_to_the_accelerations_of_the_motion():
    """25 deg at 1 Hz: within a tick everywhere, accelerations to 3 %, where a curve through ticks has 90 %."""
    ticks = STEP * np.round(angle(TIME) / STEP)
    assert resolution(ticks) == pytest.approx(STEP, rel=1e-9)
    smooth = smoothing_spline(TIME, ticks, cutoff_of(TIME, ticks, ROUNDED * STEP))(TIME)
    assert np.abs(smooth - angle(TIME)).max() < STEP
    inner = TIME[20:-20]
    true = -((2 * np.pi) ** 2) * angle(inner)
    off, rough = (np.sqrt(np.mean((CubicSpline(TIME, y)(inner, 2) - true) ** 2)) for y in (smooth, ticks))
    size = np.sqrt(np.mean(true**2))
    assert off < 0.03 * size and rough > 0.5 * size


@pytest.mark.parametrize(("unit", "digits"), [(1.0, 6), (180 / np.pi, 2)], ids=["rad", "deg"])
def test_ticks_that_are_written_with_few_digits_are_ticks(unit, digits):
    ticks = np.round(unit * STEP * np.round(angle(TIME) / STEP), digits)
    assert resolution(ticks) == pytest.approx(unit * STEP, rel=2e-4)  # the ends are rounded by half a digit each


@pytest.mark.parametrize(
    "values",
    [
        angle(TIME),
        np.round(angle(TIME), 6),
        10 * np.floor(TIME),
        np.where(np.sin(TIME) > 0, 1.0, 0.0),
        np.full(1250, 2.0),
        1e-3 * np.random.default_rng(0).normal(size=1250),
    ],
    ids=["exact", "many digits", "steps of a command", "on and off", "constant", "noise"],
)
def test_what_has_no_coarse_steps_has_none(values):
    assert resolution(values) == 0

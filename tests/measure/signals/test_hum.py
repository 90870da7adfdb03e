"""A notch: hum of the mains goes, however it grows and however slow it looks; what is measured stays."""

import numpy as np
import pytest

from nectosome.measure.signals.hum import hum_of, looks_like, notch
from nectosome.measure.signals.metadata import processing

from .made import recording, signal


def beat(t):
    """What is measured: two harmonics of a beat, and a line."""
    return np.sin(2 * np.pi * t) + 0.2 * np.sin(6 * np.pi * t + 1) + 0.1 * t


def hum(t, f):
    """Hum that grows by 10 % a second."""
    return 0.4 * (1 + 0.1 * t) * np.sin(2 * np.pi * f * t + 1)


@pytest.mark.parametrize("rate", [80.0, 104.0, 1000.0])
@pytest.mark.parametrize("off", [0.0, 0.03])
def test_hum_goes_and_what_is_measured_stays(rate: float, off: float):
    """Also above half of the sampling rate, as in 80 samples/s of a load cell; mains are off by 0.03 Hz at times."""
    t = 3 + np.arange(0, 12, 1 / rate)
    left = notch(signal(t, beat(t) + hum(t, 50 + off)), 50.0).values - beat(t)
    inside = (t > 4) & (t < t[-1] - 1)
    assert np.std(left[inside]) < (2e-3 if off == 0 else 0.02) * np.std(hum(t, 50.0))
    assert np.abs(left).max() < (0.02 if off == 0 else 0.15) * np.abs(hum(t, 50.0)).max()
    assert np.abs(hum_of(t, beat(t), 50.0)).max() < 2e-4


def test_samples_may_be_lost_and_times_be_whole_milliseconds():
    """Times that are rounded are wrong by 0.3 ms, 0.09 rad of 50 Hz."""
    random = np.random.default_rng(0)
    t = np.arange(0, 12, 1 / 80)
    values = beat(t) + hum(t, 50.0)
    values[random.random(t.size) < 0.05] = np.nan
    values[(t > 5) & (t < 7)] = np.nan
    left = values - hum_of(np.round(t, 3), values, 50.0) - beat(t)
    assert np.nanstd(left) < 0.12 * np.std(hum(t, 50.0))
    known = np.isfinite(values)
    left = notch(signal(t[known], values[known]), 50.0).values - beat(t[known])
    assert np.std(left) < 0.02 * np.std(hum(t, 50.0))


def test_a_notch_is_a_fiftieth_of_its_frequency_wide():
    """A line 1 Hz beside 50 Hz passes by more than nine tenths, and one 0.1 Hz beside goes by more."""
    t = np.arange(0, 20, 1e-3)
    for f, least, most in ((50.1, 0.0, 0.1), (51.5, 0.9, 1.1), (47.0, 0.95, 1.05)):
        line = np.sin(2 * np.pi * f * t)
        left = np.std(notch(signal(t, line), 50.0).values[2000:-2000]) / np.std(line)
        assert least <= left <= most, f


def test_errors_and_steps_are_kept():
    t = np.arange(0, 2, 1e-3)
    x = notch(recording(t, force=beat(t), force_se=np.full(t.size, 0.2)), 50.0)
    np.testing.assert_array_equal(x["force_se"], 0.2)
    assert processing(x)[-1] == {"function": "notch", "frequency": 50.0}


def test_what_cannot_be_told_from_the_signal_is_refused():
    t = np.arange(0, 5, 1 / 50)
    assert looks_like(np.arange(0, 5, 1 / 80), 50.0) == pytest.approx(30.0)
    with pytest.raises(ValueError, match=r"50 Hz look like 0 Hz in samples taken at 50 Hz, and cannot be told"):
        notch(signal(t, beat(t)), 50.0)
    with pytest.raises(ValueError, match=r"50 Hz are found in 1 s and more, and the signal is shorter"):
        notch(signal(np.arange(0, 0.5, 1e-3), np.zeros(500)), 50.0)
    with pytest.raises(ValueError, match="frequency is 0 Hz"):
        notch(signal(t, beat(t)), 0.0)
    with pytest.raises(ValueError, match="values that are NaN or infinite"):
        notch(signal(t, np.where(t > 3, np.nan, t)), 50.0)

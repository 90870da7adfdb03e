"""Smoothing splines with a stated cut-off."""

import numpy as np
import pytest

from nectosome.measure.signals.filters import cutoff_of, noise_of, smoothing_spline

EVEN = np.arange(0.0, 8.0, 0.01)
UNEVEN = EVEN + np.random.default_rng(0).uniform(-3e-3, 3e-3, EVEN.size)


@pytest.mark.parametrize("time", [EVEN, UNEVEN], ids=["even", "uneven"])
@pytest.mark.parametrize("share", [0.25, 0.5, 1.0])
def test_gain_is_that_of_the_penalty(time, share):
    """At the cut-off a root of a half; without delay: what is left of a sine has no cosine in it."""
    cutoff, middle = 4.0, slice(150, -150)
    waves = np.exp(2j * np.pi * share * cutoff * time)
    smooth = smoothing_spline(time, waves.imag, cutoff)(time)[middle]
    sine, cosine = 2 * np.mean(smooth * waves.imag[middle]), 2 * np.mean(smooth * waves.real[middle])
    assert sine == pytest.approx(1 / (1 + (np.sqrt(2) - 1) * share**6), abs=4e-3)
    assert cosine == pytest.approx(0.0, abs=4e-3)


def test_a_parabola_passes():
    parabola = 1.0 - 2 * UNEVEN + 0.3 * UNEVEN**2
    np.testing.assert_allclose(smoothing_spline(UNEVEN, parabola, 2.0)(UNEVEN), parabola, atol=1e-9)


def test_noise_and_its_cut_off_are_known():
    """The best cut-off for a sine in white noise; the estimate of the risk comes within a tenth of its error."""
    true, rng = np.sin(2 * np.pi * UNEVEN), np.random.default_rng(1)
    noisy = true + 0.02 * rng.normal(size=UNEVEN.size)
    noise = noise_of(UNEVEN, noisy)
    assert noise == pytest.approx(0.02, rel=0.1)

    def error(cutoff):
        return np.sqrt(np.mean((smoothing_spline(UNEVEN, noisy, cutoff)(UNEVEN) - true) ** 2))

    assert error(cutoff_of(UNEVEN, noisy, noise)) < 1.1 * min(map(error, np.geomspace(1.0, 20.0, 40)))


def test_steps_that_last_many_samples_are_no_signal():
    """5 deg at 0.3 Hz in ticks at 1 kHz: an error that is the same over many samples counts once."""
    time, tick = np.arange(0.0, 7.0, 1e-3), 2 * np.pi / 4096
    ticks = tick * np.round(np.radians(5) * np.sin(0.6 * np.pi * time) / tick)
    passed = round(float(np.abs(np.diff(ticks)).sum()) / tick)
    assert passed < 0.2 * time.size
    assert cutoff_of(time, ticks, tick / 12**0.5, passed) < 4.0
    assert cutoff_of(time, ticks, tick / 12**0.5) > 20.0  # what they look like if each sample has its own error

import numpy as np
import pytest

from nectosome.measure.signals.correlation import find_period

from .made import band_limited, signal


@pytest.mark.parametrize(("period", "step"), [(1.0, 0.001), (0.37, 0.01), (0.0431, 0.01), (2.7, 0.02)])
def test_the_period_of_a_noisy_sine_with_a_harmonic_is_found(period, step):
    t = np.arange(0, 30 * period, step)
    angle = 2 * np.pi * t / period
    x = np.sin(angle) + 0.3 * np.sin(2 * angle + 1) * (period > 5 * step)
    noisy = x + 0.2 * np.random.default_rng(0).normal(size=len(t))
    found = find_period(signal(t, noisy))
    assert found.period == pytest.approx(period, rel=2e-3)
    assert found.correlation == pytest.approx(1 / (1 + 0.04 / x.var()), abs=0.05)


def test_noise_does_not_hide_the_period_of_a_square_wave():
    t = np.arange(0, 60, 0.01)
    x = np.sign(np.sin(2 * np.pi * t / 2.7)) + 0.8 * np.random.default_rng(1).normal(size=len(t))
    assert find_period(signal(t, x)).period == pytest.approx(2.7, rel=1e-3)


def test_the_search_can_be_bounded():
    t = np.arange(0, 20, 0.01)
    x = signal(t, np.sin(2 * np.pi * t))
    assert find_period(x).period == pytest.approx(1.0, rel=1e-4)
    assert find_period(x, minimum=1.5).period == pytest.approx(2.0, rel=1e-4)


@pytest.mark.parametrize("values", [band_limited(0, 10.0), lambda t: t, lambda t: np.sin(0.5 * t)])
def test_what_does_not_repeat_itself_has_no_period(values):
    t = np.arange(0, 10, 0.01)
    with pytest.raises(ValueError, match=r"has no period .* 0\.5 is needed"):
        find_period(signal(t, values(t)))

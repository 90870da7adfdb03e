import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.filters import detrend, lowpass, smooth
from nectosome.measure.signals.metadata import processing

from .made import recording, signal

T = np.arange(1000) * 0.01


def amplitude(x, t, f):
    """Amplitude and phase of the sine of frequency f in x, over whole periods away from the ends."""
    inside = (t >= 2) & (t < 8)
    z = 2 * np.mean(x[inside] * np.exp(-2j * np.pi * f * t[inside]))
    return abs(z), np.angle(z * 1j)


@given(st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_a_line_has_nothing_left_without_its_trend(a, b):
    t = np.sort(np.random.default_rng(0).uniform(0, 10, 50))
    left = detrend(signal(t, a + b * t), "linear").values
    assert np.abs(left).max() <= 1e-11 * (1 + abs(a) + abs(b))


def test_detrending_a_constant_takes_the_mean():
    x = detrend(recording(T, force=np.sin(T), force_se=np.full(1000, 0.2)))
    assert np.allclose(x["force"], np.sin(T) - np.sin(T).mean())
    assert np.allclose(x["force_se"], 0.2)


@pytest.mark.parametrize("derivative", [0, 1, 2])
def test_smoothing_is_exact_on_cubics_up_to_the_ends(derivative):
    cubic = np.polynomial.Polynomial([1.0, -2.0, 0.5, 0.3])
    x = smooth(signal(T, cubic(T), "m"), 0.21, derivative=derivative)
    expected = (cubic.deriv(derivative) if derivative else cubic)(T)
    assert np.abs(x.values - expected).max() < 1e-7
    assert x.attrs["units"] == ["m", "m/s", "m/s2"][derivative]


def test_smoothing_has_the_gain_of_the_textbook():
    """Five points, parabola: weights (-3, 12, 17, 12, -3) / 35, sum of squares 17 / 35 (Savitzky, Golay 1964)."""
    x = smooth(signal(T, T), 0.05, order=2)
    step = processing(x)[0]
    assert step["samples"] == 5
    assert step["gain"] == pytest.approx(np.sqrt(17 / 35), rel=1e-12)


def test_a_lowpass_has_the_butterworth_amplitude_and_no_phase():
    """|H| = 1 / (1 + (sqrt 2 - 1) (tan(pi f h) / tan(pi fc h))^(2n)): 1 / sqrt 2 at the cutoff."""
    fc, n, h = 5.0, 2, 0.01
    for f in (1.0, 5.0, 10.0):
        got, phase = amplitude(lowpass(signal(T, np.sin(2 * np.pi * f * T)), fc).values, T, f)
        ratio = np.tan(np.pi * f * h) / np.tan(np.pi * fc * h)
        assert got == pytest.approx(1 / (1 + (np.sqrt(2) - 1) * ratio ** (2 * n)), rel=1e-6)
        assert phase == pytest.approx(0.0, abs=1e-6)
    assert amplitude(lowpass(signal(T, np.sin(2 * np.pi * fc * T)), fc).values, T, fc)[0] == pytest.approx(0.5**0.5)


def test_a_lowpass_leaves_lines_and_end_points():
    x = lowpass(signal(T, 3 - 2 * T), 1.0)
    assert np.allclose(x, 3 - 2 * T, atol=1e-12)
    noisy = np.random.default_rng(0).normal(size=1000)
    assert np.allclose(lowpass(signal(T, noisy), 1.0)[[0, -1]], noisy[[0, -1]], atol=2e-3)


@pytest.mark.parametrize(
    "change",
    [lambda x: lowpass(x, 4.0), lambda x: smooth(x, 0.25), lambda x: smooth(x, 0.25, derivative=1)],
)
def test_standard_errors_of_white_noise_are_those_of_monte_carlo(change):
    """4000 runs of 120 samples whose noise grows: each standard deviation is known to 1.1 %; ends and middle."""
    se = np.linspace(0.5, 1.5, 120)
    noise = se * np.random.default_rng(1).normal(size=(4000, 120))
    t = np.arange(120) * 0.01
    x = recording(t, force=np.zeros(120)).drop_vars("force")
    out = change(x.assign(force=(("run", "time"), noise), force_se=("time", se)))
    ratio = out["force"].std("run") / out["force_se"].isel(run=0)
    assert np.abs(ratio - 1).max() < 0.055


def test_the_gain_is_the_root_of_the_sum_of_squares_of_the_answer_to_an_impulse():
    impulse = np.zeros(1000)
    impulse[500] = 1.0
    for x in (lowpass(signal(T, impulse), 4.0), smooth(signal(T, impulse), 0.25, derivative=1)):
        assert processing(x)[0]["gain"] == pytest.approx(np.sqrt(np.sum(x.values**2)), rel=1e-3)


def test_a_second_filter_gives_a_bound_since_errors_are_no_longer_independent():
    noise = np.random.default_rng(2).normal(size=(2000, 200))
    x = recording(T[:200], force=np.zeros(200)).assign(force=(("run", "time"), noise), force_se=("time", np.ones(200)))
    once = lowpass(x, 4.0)
    twice = lowpass(once, 4.0)
    really = twice["force"].std("run")
    assert (twice["force_se"].isel(run=0) > 0.95 * really).all()  # known to 1.6 %
    as_if_independent = processing(once)[0]["gain"] * once["force_se"].isel(run=0)
    assert as_if_independent[100] < 0.7 * really[100]


def test_filters_follow_units_and_do_not_care_when():
    x = np.random.default_rng(3).normal(size=1000)
    plain = lowpass(recording(T, force=x, force_se=np.ones(1000)), 5.0)
    scaled = lowpass(recording(T + 1e4, force=1e3 * x, force_se=np.full(1000, 1e3)), 5.0)
    assert np.allclose(scaled["force"], 1e3 * plain["force"], atol=1e-4)
    assert np.allclose(scaled["force_se"], 1e3 * plain["force_se"], rtol=1e-6)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda: lowpass(signal(np.sort(np.r_[T[:500], T[:499] + 0.003]), np.zeros(999)), 5.0),
            "even steps .*resample",
        ),
        (lambda: lowpass(signal(T, T), 50.0), "50 Hz; it must be below half the sampling rate, 50 Hz"),
        (lambda: lowpass(signal(T[:20], T[:20]), 1.0), r"20 samples, and at 1 Hz more than \d+"),
        (lambda: lowpass(signal(T, np.where(T == 5, np.nan, T)), 5.0), "1 values .* first at 5 s"),
        (lambda: lowpass(signal(T, T), -1.0), "cutoff is -1 Hz"),
        (lambda: smooth(signal(T, T), 0.03), "3 samples"),
        (lambda: smooth(signal(T, T), 20.0), "0.05 s to 10 s"),
        (lambda: smooth(signal(T, T), 0.1, derivative=4), "0 to 3"),
        (lambda: smooth(signal(T[::-1], T), 0.1), "it must increase"),
        (lambda: detrend(signal(T, T), "curve"), "constant"),
    ],
)
def test_what_cannot_be_filtered_is_refused_with_its_numbers(call, message):
    with pytest.raises(ValueError, match=message):
        call()

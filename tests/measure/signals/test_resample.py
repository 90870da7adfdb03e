import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.metadata import processing
from nectosome.measure.signals.resample import resample

from .made import recording, signal

T = np.arange(2001) * 0.001


@given(st.integers(0, 10_000))
def test_lines_are_met_between_uneven_samples(seed):
    t = np.cumsum(np.random.default_rng(seed).uniform(0.5, 1.5, 40))
    new = np.linspace(t[0], t[-1], 57)
    for method in ("linear", "cubic"):
        x = resample(signal(t, 2 - 3 * t), times=new, method=method)
        assert np.allclose(x, 2 - 3 * new, atol=1e-9)


def test_a_spline_meets_cubics_and_sines_better_than_a_line():
    t = np.linspace(0, 1, 41)
    new = np.linspace(0, 1, 500)
    x = resample(signal(t, t**3 - t), times=new, method="cubic")
    assert np.allclose(x, new**3 - new, atol=1e-12)


def test_samples_stay_at_their_own_times():
    x = np.random.default_rng(0).normal(size=50)
    t = np.cumsum(np.random.default_rng(1).uniform(0.5, 1.5, 50))
    for method in ("linear", "cubic"):
        assert np.allclose(resample(signal(t, x), times=t, method=method), x)


def test_nothing_is_said_beyond_the_ends_across_a_gap_or_around_nan():
    t = np.r_[0:10, 20:30].astype(float)
    x = t.copy()
    x[4] = np.nan
    new = np.arange(-2, 32) + 0.5
    y = resample(recording(t, force=x, force_se=np.ones(20)), times=new, gap=5.0)
    known = ((new > 0) & (new < 3)) | ((new > 5) & (new < 9)) | ((new > 20) & (new < 29))
    assert np.array_equal(np.isfinite(y["force"]), known)
    assert np.array_equal(np.isfinite(y["force_se"]), known)
    assert np.allclose(y["force"][known], new[known])


def test_a_gap_is_five_median_steps_where_nothing_is_said():
    t = np.r_[0:10, 14:20, 26:30].astype(float)
    y = resample(signal(t, t), times=np.array([11.0, 12.0, 23.0, 24.0]))
    assert np.array_equal(np.isnan(y), [False, False, True, True])
    assert processing(y)[0]["gap"] == 5.0


def test_a_rate_starts_at_the_first_sample_and_ends_before_the_last():
    x = resample(signal(T, T), rate=300.0, method="cubic")
    assert float(x.time[0]) == 0.0
    assert np.allclose(np.diff(x.time), 1 / 300)
    assert float(x.time[-1]) == pytest.approx(2.0)
    assert np.allclose(x, x.time)


def test_what_the_lower_rate_cannot_hold_is_taken_off_first():
    """At 100 Hz a sine of 10 Hz stays, one of 90 Hz would come back as 10 Hz."""
    slow, fast = (resample(signal(T, np.sin(2 * np.pi * f * T)), rate=100.0) for f in (10.0, 90.0))
    inside = slice(40, 160)
    assert np.allclose(slow[inside], np.sin(2 * np.pi * 10 * slow.time[inside]), atol=1e-4)
    assert np.abs(fast[inside]).max() < 1e-3
    assert processing(slow)[0]["antialias"] == 40.0
    assert processing(resample(signal(T, T), rate=1000.0))[0]["antialias"] is None


def test_standard_errors_behind_the_anti_alias_filter_are_those_of_monte_carlo():
    """120 runs of 40 samples: each standard deviation is known to 6.5 %, their mean better."""
    noise = np.random.default_rng(1).normal(size=(120, 400))
    x = recording(T[:400], force=np.zeros(400)).assign(force=(("run", "time"), noise), force_se=("time", np.ones(400)))
    y = resample(x, rate=100.0)
    ratio = y["force"].std("run") / y["force_se"].isel(run=0)
    assert abs(float(ratio.mean()) - 1) < 0.03
    assert np.abs(ratio - 1).max() < 0.26


def test_standard_errors_between_samples_are_a_bound():
    noise = np.random.default_rng(1).normal(size=(1500, 50))
    x = recording(np.arange(50.0), force=np.zeros(50)).assign(
        force=(("run", "time"), noise), force_se=("time", np.ones(50))
    )
    y = resample(x, times=np.arange(0.5, 48))
    assert np.allclose(y["force_se"], 1.0)
    assert np.allclose(y["force"].std("run"), np.sqrt(0.5), atol=0.06)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: resample(signal(T, T)), "either a rate"),
        (lambda: resample(signal(T, T), rate=1.0, times=T), "either a rate"),
        (lambda: resample(signal(T, T), rate=-5.0), "rate is -5 Hz"),
        (lambda: resample(signal(T, T), times=T[::-1]), "increase"),
        (lambda: resample(signal(T, T), rate=2.0), "no stretch of signal .* higher rate"),
        (lambda: resample(signal(T, T), rate=10.0, method="best"), "linear"),
    ],
)
def test_what_makes_no_sense_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()

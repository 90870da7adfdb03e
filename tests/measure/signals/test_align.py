import numpy as np
import pytest

from nectosome.measure.signals.correlation import align, align_at
from nectosome.measure.signals.metadata import processing

from .made import band_limited, recording

T = np.arange(600) * 0.01


@pytest.mark.parametrize("highest", [2.0, 10.0, 25.0, 40.0])
@pytest.mark.parametrize("delay", [0.0, 0.0137, -0.0249, 0.31])
def test_the_delay_of_band_limited_noise_is_found_to_a_twentieth_of_a_sample(highest, delay):
    x = band_limited(1, highest)
    a, b = recording(T, force=x(T)), recording(T, force=3 * x(T - delay) + 5)
    found = align(a, b, "force", max_lag=1.0)
    assert found.lag == pytest.approx(delay, abs=0.01 / 20)
    assert found.correlation > 0.99
    assert np.allclose(found.recording.time, T - found.lag)


def test_the_standard_error_of_a_lag_is_that_of_monte_carlo():
    """40 runs: their spread is known to 11 %."""
    x, rng = band_limited(2, 10.0), np.random.default_rng(0)
    runs = []
    for _ in range(40):
        delay = rng.uniform(-0.1, 0.1)
        noisy = [recording(T, force=x(t) + 0.3 * rng.normal(size=600)) for t in (T, T - delay)]
        found = align(*noisy, "force", max_lag=0.5)
        runs.append((found.lag - delay, found.lag_se))
    error, se = np.array(runs).T
    assert np.sqrt(np.mean(error**2)) == pytest.approx(se.mean(), rel=0.35)


def test_clocks_rates_and_roles_may_differ():
    """Load cell at 1000 Hz, IMU about every 0.1 s with another zero of time."""
    x, rng = band_limited(3, 3.0), np.random.default_rng(1)
    ta = np.arange(0, 30, 0.001)
    tb = np.arange(5, 25, 0.1) + rng.uniform(-0.01, 0.01, 200)
    a = recording(ta, force=x(ta) + 0.1 * rng.normal(size=len(ta)))
    b = recording(tb + 100.4, force=x(tb) + 0.1 * rng.normal(size=200))
    there, back = align(a, b, "force"), align(b, a, "force")
    assert there.lag == pytest.approx(100.4, abs=4 * there.lag_se)
    assert there.lag_se < 0.002
    assert back.lag == pytest.approx(-there.lag, abs=1e-9)


def test_the_lag_is_written_down():
    x = band_limited(1, 10.0)
    found = align(recording(T, force=x(T)), recording(T, force=x(T - 0.2)), "force")
    step = processing(found.recording)[-1]
    assert step["function"] == "align" and step["lag"] == found.lag and step["lag_se"] == found.lag_se


def test_triggers_are_put_over_each_other():
    """A ramp of 2 N/s with errors of 0.01 N crosses at a time known to 5 ms; to 1/sqrt 2 of that between samples."""
    a = recording(T, force=2 * (T - 1.0), force_se=np.full(600, 0.01))
    b = recording(T, force=2 * (T - 3.505), force_se=np.full(600, 0.01))
    found = align_at(a, b, "force", 0.5)
    assert found.lag == pytest.approx(2.505, abs=1e-12)
    assert found.lag_se == pytest.approx(np.hypot(0.005, 0.005 / np.sqrt(2)), rel=1e-6)
    assert np.isnan(align_at(a.drop_vars("force_se"), b, "force", 0.5).lag_se)


def test_a_pulse_rises_anywhere_between_two_samples():
    """Even over a sample of 10 and one of 25 ms: standard errors of these over sqrt 12."""
    fast, slow = 0.01 * np.arange(300), 0.002 + 0.025 * np.arange(120)
    a, b = (recording(t, sync=np.where((t > 1) & (t < 1.2), 1.0, 0.0)) for t in (fast, slow))
    found = align_at(a, b, "sync", 0.5)
    assert found.lag_se == pytest.approx(np.hypot(0.01, 0.025) / np.sqrt(12), rel=1e-9)
    assert abs(found.lag) < 3 * found.lag_se


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda a, b: align(a, b, "pulse"), "no pulse in one of the recordings; it has force"),
        (lambda a, b: align(a, b, "force", max_lag=0.2), "end of the search"),
        (lambda a, b: align(a, -b, "force", max_lag=0.01), "end of the search|no positive correlation at any lag"),
        (lambda a, b: align(a, 0 * b, "force"), "no positive correlation at any lag"),
        (lambda a, b: align(a.isel(time=np.r_[:200, 300:600]), b, "force"), "gap from 1.99 s to 3 s"),
        (lambda a, b: align(a.where(a.time > 0.1), b, "force"), "NaN or infinite"),
        (lambda a, b: align_at(a, b, "force", 100.0), "does not rise through 100"),
    ],
)
def test_what_cannot_be_aligned_is_refused(call, message):
    x = band_limited(1, 0.5)
    with pytest.raises(ValueError, match=message):
        call(recording(T, force=x(T)), recording(T, force=x(T - 0.5)))

import numpy as np
import pytest

from nectosome.measure.signals.peaks import peaks

from .made import signal

T = np.arange(0, 10, 0.02)


def test_the_vertex_of_a_parabola_is_met_between_uneven_samples():
    t = np.cumsum(np.random.default_rng(0).uniform(0.2, 1.0, 20))
    found = peaks(signal(t, 3 - 2 * (t - 5.123) ** 2), 1.0)
    assert found["time"].values == pytest.approx([5.123], abs=1e-12)
    assert found["height"].values == pytest.approx([3.0], abs=1e-12)


def test_peaks_of_a_sine_lie_a_period_apart_with_its_amplitude():
    found = peaks(signal(T, 2 * np.sin(2 * np.pi * T)), 1.0)
    assert found["time"].values == pytest.approx(0.25 + np.arange(10), abs=1e-5)
    assert found["height"].values == pytest.approx(np.full(10, 2.0), rel=1e-4)
    assert found["height"].attrs["units"] == "N"


def test_small_and_close_peaks_are_passed_over():
    x = signal(T, np.sin(2 * np.pi * T) + 0.1 * np.sin(2 * np.pi * 7 * T + 0.5))
    assert peaks(x, 0.01).sizes["peak"] > 20
    assert peaks(x, 0.8).sizes["peak"] == 10
    assert peaks(x, 0.01, distance=0.9).sizes["peak"] in (10, 11)


def test_a_flat_top_is_met_at_a_sample_of_it_and_ends_are_no_peaks():
    t = np.arange(8.0)
    found = peaks(signal(t, [5, 0, 1, 1, 1, 0, 0, 5]), 0.5)
    assert found["time"].values.tolist() == [3.0]
    assert found["height"].values.tolist() == [1.0]


def test_peaks_follow_shifts_and_units():
    x = np.random.default_rng(1).normal(size=500)
    plain, other = peaks(signal(T, x), 1.0), peaks(signal(T + 100, 1000 * x), 1000.0)
    assert np.allclose(other["time"], plain["time"] + 100)
    assert np.allclose(other["height"], 1000 * plain["height"])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: peaks(signal(T, T), 0.0), "prominence is 0 N"),
        (lambda: peaks(signal(T, np.where(T > 5, np.nan, T)), 1.0), "NaN or infinite"),
        (lambda: peaks(signal(np.r_[T[:50], T[50:] + 1], T), 1.0, distance=0.5), "even steps"),
    ],
)
def test_what_has_no_peaks_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()

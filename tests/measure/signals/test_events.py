import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.events import (
    Window,
    crossings,
    peaks,
    split,
    split_at_idle,
    split_at_resets,
    strokes,
    windows_where,
)
from nectosome.measure.signals.metadata import processing

from .made import recording, signal

T = np.arange(2000) * 0.005


def test_crossings_of_a_line_are_exact():
    t = np.cumsum(np.random.default_rng(0).uniform(0.1, 2.0, 30))
    assert crossings(signal(t, 3 * (t - 7.77)), 0.0).values == pytest.approx([7.77], abs=1e-12)


def test_a_sine_rises_and_falls_once_a_period():
    x = signal(T, np.sin(2 * np.pi * T - 0.3))
    assert crossings(x, 0.0).values == pytest.approx(0.3 / (2 * np.pi) + np.arange(10), abs=1e-4)
    falling = crossings(x, 0.5, direction="falling").values
    assert falling == pytest.approx((0.3 + np.pi * 5 / 6) / (2 * np.pi) + np.arange(10), abs=1e-4)


@given(st.integers(0, 10_000))
def test_noise_below_half_the_hysteresis_adds_no_crossing(seed):
    noise = np.random.default_rng(seed).uniform(-0.1, 0.1, 2000)
    clean = np.sin(2 * np.pi * T - 0.3)
    found = crossings(signal(T, clean + noise), 0.0, hysteresis=0.2).values
    assert len(found) == 10
    assert np.abs(found - 0.3 / (2 * np.pi) - np.arange(10)).max() < 0.1 / (2 * np.pi) * 1.1 + 0.005


@given(st.lists(st.integers(-3, 3), min_size=2, max_size=40), st.sampled_from([0.0, 1.0, 3.0]))
def test_rises_and_falls_alternate(values, hysteresis):
    x = signal(np.arange(float(len(values))), values)
    up = crossings(x, 0.5, hysteresis=hysteresis).values
    down = crossings(x, 0.5, hysteresis=hysteresis, direction="falling").values
    assert abs(len(up) - len(down)) <= 1
    assert np.array_equal(np.sort(np.r_[up, down]), np.r_[up, down][np.argsort(np.r_[up, down])])
    order = np.r_[np.ones(len(up)), -np.ones(len(down))][np.argsort(np.r_[up, down], kind="stable")]
    assert np.all(np.diff(order) != 0)


def test_a_signal_that_never_crosses_has_no_events():
    assert crossings(signal(T, np.sin(T)), 2.0).sizes["event"] == 0


def test_windows_are_the_stretches_in_which_a_condition_holds():
    t = np.arange(10.0)
    x = signal(t, [0, 0, 1, 1, 1, 0, 1, 0, 1, 1])
    assert windows_where(x > 0.5) == [Window(2, 4), Window(6, 6), Window(8, 9)]
    assert windows_where(x > 0.5, minimum=1.0) == [Window(2, 4), Window(8, 9)]
    assert windows_where(x > 0.5, minimum=1.5) == [Window(2, 4)]
    assert windows_where(x > 2) == []
    assert windows_where(x.where(x.time != 3) > 0.5, minimum=1.0) == [Window(8, 9)]


def test_strokes_of_a_triangle_go_from_end_to_end():
    t = np.arange(0, 12.0001, 0.01)
    x = np.abs((t + 0.5) % 4 - 2)  # 1.5 at the start, 0 at 1.5 s, 2 at 3.5 s, ...
    found = strokes(signal(t, x), 0.3)
    assert [s.start for s in found] == pytest.approx([0.0, 1.5, 3.5, 5.5, 7.5, 9.5, 11.5])
    assert [s.end for s in found] == pytest.approx([1.5, 3.5, 5.5, 7.5, 9.5, 11.5, 12.0])
    assert [s.change for s in found] == pytest.approx([-1.5, 2, -2, 2, -2, 2, -0.5])


@given(st.integers(0, 10_000), st.floats(0.3, 3.0))
def test_strokes_alternate_and_are_as_long_as_they_promise(seed, excursion):
    x = np.cumsum(np.random.default_rng(seed).normal(size=300)) * 0.3
    found = strokes(signal(np.arange(300.0), x), excursion)
    change = np.array([s.change for s in found])
    assert np.all(np.abs(change) >= excursion)
    assert np.all(change[1:] * change[:-1] < 0)
    assert len(found) or np.ptp(x) < 2 * excursion


def test_small_motions_make_no_stroke():
    x = np.sin(2 * np.pi * T) + 0.05 * np.random.default_rng(0).normal(size=2000)
    assert len(strokes(signal(T, x), 0.5)) == 21  # a quarter first, then halves, a quarter last
    assert strokes(signal(T, x), 5.0) == []
    assert strokes(signal(T, np.zeros(2000)), 0.1) == []


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: crossings(signal(T, np.where(T == 5, np.nan, T)), 1.0), "NaN or infinite"),
        (lambda: crossings(signal(T, T), 1.0, hysteresis=-1.0), "hysteresis is -1"),
        (lambda: crossings(signal(T, T), 1.0, direction="up"), "rising"),
        (lambda: windows_where(signal(T, T)), "float64 .* true and false"),
        (lambda: strokes(signal(T, T), 0.0), "excursion is 0 N"),
    ],
)
def test_what_makes_no_sense_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


FINE = np.arange(0, 10, 0.02)


def test_the_vertex_of_a_parabola_is_met_between_uneven_samples():
    t = np.cumsum(np.random.default_rng(0).uniform(0.2, 1.0, 20))
    found = peaks(signal(t, 3 - 2 * (t - 5.123) ** 2), 1.0)
    assert found["time"].values == pytest.approx([5.123], abs=1e-12)
    assert found["height"].values == pytest.approx([3.0], abs=1e-12)


def test_peaks_of_a_sine_lie_a_period_apart_with_its_amplitude():
    found = peaks(signal(FINE, 2 * np.sin(2 * np.pi * FINE)), 1.0)
    assert found["time"].values == pytest.approx(0.25 + np.arange(10), abs=1e-5)
    assert found["height"].values == pytest.approx(np.full(10, 2.0), rel=1e-4)
    assert found["height"].attrs["units"] == "N"


def test_small_and_close_peaks_are_passed_over():
    x = signal(FINE, np.sin(2 * np.pi * FINE) + 0.1 * np.sin(2 * np.pi * 7 * FINE + 0.5))
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
    plain, other = peaks(signal(FINE, x), 1.0), peaks(signal(FINE + 100, 1000 * x), 1000.0)
    assert np.allclose(other["time"], plain["time"] + 100)
    assert np.allclose(other["height"], 1000 * plain["height"])


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: peaks(signal(FINE, FINE), 0.0), "prominence is 0 N"),
        (lambda: peaks(signal(FINE, np.where(FINE > 5, np.nan, FINE)), 1.0), "NaN or infinite"),
        (lambda: peaks(signal(np.r_[FINE[:50], FINE[50:] + 1], FINE), 1.0, distance=0.5), "even steps"),
    ],
)
def test_what_has_no_peaks_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()


LOG = np.arange(1000) * 0.01


def test_runs_lie_between_idle_times_and_keep_short_pauses():
    moving = ((LOG >= 1) & (LOG < 3)) | ((LOG >= 3.2) & (LOG < 4)) | ((LOG >= 7) & (LOG < 9))
    log = recording(LOG, speed=moving * 0.5)
    runs = split_at_idle(log, abs(log["speed"]) < 0.1, minimum=0.5)
    ends = [float(t) for run in runs for t in run.time[[0, -1]]]
    assert ends == pytest.approx([1.0, 3.99, 7.0, 8.99])
    assert processing(runs[0])[-1]["function"] == "split"


def test_a_log_without_idle_time_is_one_run():
    log = recording(LOG, speed=np.ones(1000))
    assert len(split_at_idle(log, log["speed"] < 0.1, 0.5)) == 1


def test_a_log_that_was_started_anew_is_split_there():
    t = np.r_[LOG[:300], LOG[:200], LOG[50:100]]
    parts = split_at_resets(recording(t, force=np.arange(550.0)))
    assert [p.sizes["time"] for p in parts] == [300, 200, 50]
    assert np.concatenate([p["force"] for p in parts]).tolist() == list(range(550))
    assert all(np.all(np.diff(p.time) > 0) for p in parts)


def test_strokes_are_cut_out_with_their_ends():
    log = recording(LOG, x=np.abs(LOG % 2 - 1))
    parts = split(log, strokes(log["x"], 0.5))
    assert [float(p["x"][-1] - p["x"][0]) for p in parts[:4]] == pytest.approx([-1, 1, -1, 1])


def test_what_cannot_be_split_is_refused():
    log = recording(LOG, speed=LOG)
    with pytest.raises(ValueError, match="window 0, from 20 s to 30 s, has no sample"):
        split(log, [Window(20.0, 30.0)])
    with pytest.raises(ValueError, match=r"time is 0\.01 s and 0\.01 s in samples 1 and 2"):
        split_at_resets(recording([0.0, 0.01, 0.01, 0.02], force=np.zeros(4)))
    with pytest.raises(ValueError, match="10 samples; it needs the 1000"):
        split_at_idle(log, log["speed"][:10] > 0, 1.0)

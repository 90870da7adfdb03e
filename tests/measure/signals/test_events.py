import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from nectosome.measure.signals.events import Window, crossings, strokes, windows_where

from .made import signal

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

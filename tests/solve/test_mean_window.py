"""Means over whole beats, and whether a motion has settled: of signals whose answer is known."""

import numpy as np
import pytest

from nectosome.solve.mean_window import beats_of_samples, mean_weights, mean_window, settling

BEAT = 0.5


def test_weights_are_exact_for_what_is_straight_between_samples():
    time = np.array([0.0, 0.1, 0.15, 0.4, 0.7, 1.0])
    for start in (0.0, 0.12, 0.4, 0.93):
        for end in (1.0, 0.97):
            weights = mean_weights(time, start, end)
            assert weights.sum() == pytest.approx(1.0, abs=1e-14)
            middle = 0.5 * (start + end)
            assert weights @ (3 - 2 * time) == pytest.approx(3 - 2 * middle, abs=1e-13)
        assert (weights[:-1] > 0).tolist() == (time[1:] > start).tolist()


def test_a_change_that_shrinks_tells_what_it_comes_to():
    """u = 2 - exp(-t) + 0.3 sin(2 pi t/T): its beats' means go to 2, by exp(-T) each."""
    time = np.linspace(0, 2, 4001)
    found = settling(beats_of_samples(time, 2 - np.exp(-time) + 0.3 * np.sin(2 * np.pi * time / BEAT), BEAT))
    last = 2 - (np.exp(-1.5) - np.exp(-2.0)) / BEAT
    assert found.last == pytest.approx(last, rel=1e-6)
    assert found.change == pytest.approx((2 - last) * (np.exp(BEAT) - 1) / last, rel=1e-5)
    assert found.limit == pytest.approx(2.0, rel=1e-4)
    assert not found.settled


def test_a_motion_that_repeats_itself_has_settled():
    time = np.linspace(0, 2, 2001)
    assert settling(beats_of_samples(time, 1 + np.sin(2 * np.pi * time / BEAT) ** 2, BEAT)).settled
    growing = settling(beats_of_samples(time, time**2, BEAT))
    assert not growing.settled and np.isnan(growing.limit)  # it would come to nothing
    assert settling(beats_of_samples(time, np.sin(2 * np.pi * time / BEAT), 1.5)) is None  # too short


def test_without_a_beat_means_are_over_a_tenth_of_the_run():
    time = np.linspace(0, 3, 31)
    assert mean_window(time, {}) == (pytest.approx(2.7), "the last 300 ms", 0)
    assert mean_window(time, {"period": 3.0}) == (0.0, "the cycle", 0)

"""Gaps filled where that is asked for, and nowhere else."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nectosome.vision.cameras import fill, fill_rotations

T = np.arange(40) * 0.01


def gaps(values, *spans):
    out = values.copy()
    for a, b in spans:
        out[a:b] = np.nan
    return out


def where(mask):
    return np.flatnonzero(mask).tolist()


@pytest.mark.parametrize(("how", "power"), [("linear", 1), ("cubic", 3)])
def test_polynomials_are_filled_exactly(how, power):
    t = np.sort(np.random.default_rng(0).uniform(0, 1, 40))
    exact = (t - 0.4) ** power + 0.3 * t
    values, filled = fill(t, gaps(exact, (5, 8), (20, 22)), 1.0, how)
    assert values == pytest.approx(exact, abs=1e-12)
    assert where(filled) == [5, 6, 7, 20, 21]


def test_only_short_gaps_between_values_are_filled():
    """From 0.09 s to 0.13 s are 0.04 s; from 0.19 s to 0.24 s are 0.05 s; the ends have no other side."""
    values, filled = fill(T, gaps(T, (0, 2), (10, 13), (20, 24), (37, 40)), 0.04)
    assert where(filled) == [10, 11, 12]
    assert where(np.isnan(values)) == [0, 1, 20, 21, 22, 23, 37, 38, 39]


def test_a_gap_as_long_as_allowed_is_filled_and_one_frame_more_is_not():
    for n, expected in ((3, [10, 11, 12]), (4, [])):
        assert where(fill(T, gaps(T, (10, 10 + n)), 0.04)[1]) == expected


@given(st.lists(st.booleans(), min_size=40, max_size=40), st.floats(0.011, 0.2), st.sampled_from(["linear", "cubic"]))
def test_nothing_else_is_touched(missing, longest, how):
    exact = np.sin(9 * T)
    before = np.where(missing, np.nan, exact)
    kept = before.copy()
    after, filled = fill(T, before, longest, how)
    assert np.array_equal(before, kept, equal_nan=True)
    assert np.array_equal(after[~filled], before[~filled], equal_nan=True)
    assert np.isnan(before[filled]).all() and np.isfinite(after[filled]).all()
    known = np.flatnonzero(~np.isnan(before))
    for k in np.flatnonzero(np.isnan(before)):
        left, right = known[known < k], known[known > k]
        short = len(left) and len(right) and T[right[0]] - T[left[-1]] <= longest + 1e-9
        assert filled[k] == bool(short)


def test_columns_are_filled_on_their_own():
    exact = np.stack([T, 2 * T, 3 * T], axis=1).reshape(40, 1, 3)
    before = exact.copy()
    before[5:7, 0, 0], before[6:20, 0, 2] = np.nan, np.nan
    after, filled = fill(T, before, 0.05)
    assert filled.shape == (40, 1, 3) and where(filled[:, 0, 0]) == [5, 6] and not filled[:, 0, 1:].any()
    assert after[:, 0, :2] == pytest.approx(exact[:, 0, :2])
    assert np.isnan(after[6:20, 0, 2]).all()


def test_a_spline_does_not_look_across_a_gap_that_stays():
    """Beyond the long gap the values are of another size: those before it are filled as if they were not there."""
    step = np.where(T < 0.2, np.sin(20 * T), 1e3 * np.cos(90 * T))
    before = gaps(step, (15, 17), (19, 30))
    with_it, _ = fill(T, before, 0.05, "cubic")
    alone, _ = fill(T[:19], before[:19], 0.05, "cubic")
    assert with_it[:19] == pytest.approx(alone, abs=1e-15)
    assert with_it[15:17] == pytest.approx(step[15:17], abs=1e-3)


def test_rotations_turn_at_a_constant_rate():
    axis = np.array([1.0, 2.0, -0.5]) / np.linalg.norm([1.0, 2.0, -0.5])
    exact = Rotation.from_rotvec(np.outer(3 * T, axis)).as_matrix()
    before = gaps(exact, (10, 13), (20, 30), (38, 40))
    before[15, 1, 2] = np.nan
    after, filled = fill_rotations(T, before, 0.05)
    assert where(filled) == [10, 11, 12, 15]
    assert after[filled] == pytest.approx(exact[filled], abs=1e-12)
    assert np.array_equal(after[~filled], before[~filled], equal_nan=True)


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: fill(T, T, 0.0), "longest is 0 s"),
        (lambda: fill(T, T[:5], 0.1), "do not match values"),
        (lambda: fill(T[::-1], T, 0.1), "it must increase"),
        (lambda: fill(T, np.where(T == 0.05, np.inf, T), 0.1), "infinite"),
        (lambda: fill(T, T, 0.1, "quintic"), 'how is "quintic"'),  # type: ignore[arg-type]
        (lambda: fill_rotations(T, np.zeros((40, 3)), 0.1), r"\[t, 3, 3\] is expected"),
        (lambda: fill_rotations(T, np.tile(2 * np.eye(3), (40, 1, 1)), 0.1), " 0 s: not a rotation"),
        (lambda: fill_rotations(T, np.tile(np.diag([1.0, 1, -1]), (40, 1, 1)), 0.1), "not a rotation"),
    ],
)
def test_what_cannot_be_filled_is_refused(call, message):
    with pytest.raises(ValueError, match=message):
        call()

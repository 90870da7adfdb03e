"""Correlation of two signals over their lag, and the peak of it."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.signal import correlate

TOP = 0.8  # [highest correlation]: correlations above belong to the peak


class Peak(NamedTuple):
    """Peak of a correlation."""

    lag: float
    height: float
    curvature: float  # - d2r/dlag2


def correlations(
    a: Float[np.ndarray, "n"], b: Float[np.ndarray, "m"], least: int
) -> tuple[Int[np.ndarray, "k"], Float[np.ndarray, "k"]]:
    """Pearson's r of a_i and b_{i+lag} over their overlap, for every lag with an overlap of at least `least` samples.

    Means and variances are those of the overlap, so that a short one does not lower r. r = 0 for a constant signal.
    """
    a, b = a - a.mean(), b - b.mean()
    one_a, one_b = np.ones_like(a), np.ones_like(b)
    count = np.round(correlate(one_b, one_a, method="fft"))
    enough = count >= least
    lags, count = np.arange(-len(a) + 1, len(b))[enough], count[enough]

    def total(y: Float[np.ndarray, "m"], x: Float[np.ndarray, "n"]) -> Float[np.ndarray, "k"]:
        return correlate(y, x, method="fft")[enough]

    sum_a, sum_b = total(one_b, a), total(b, one_a)
    var_a = total(one_b, a * a) - sum_a**2 / count
    var_b = total(b * b, one_a) - sum_b**2 / count
    flat = (var_a <= 1e-12 * (a @ a)) | (var_b <= 1e-12 * (b @ b))
    r = (total(b, a) - sum_a * sum_b / count) / np.sqrt(np.where(flat, 1.0, var_a * var_b))
    return lags, np.where(flat, 0.0, r)


def top_width(r: Float[np.ndarray, "n"], at: int) -> float:
    """Half width [lags] of the peak at index `at`: the smaller distance to 0.8 of its height; 1 at an end."""
    level = TOP * r[at]
    widths = []
    for side in (r[at:], r[at::-1]):
        below = np.flatnonzero(side < level)
        if len(below):
            i = below[0]
            widths.append(i - 1 + (side[i - 1] - level) / (side[i - 1] - side[i]))
    return float(min(widths, default=1.0))


def part_to_fit(height: float) -> float:
    """Fraction of the half width to fit: 1 for a peak of at most 0.95 (noise), less for a higher one."""
    return float(np.sqrt(np.clip(4 * (1 - height) / (1 - TOP), 0.01, 1.0)))


def parabola_top(lag: Float[np.ndarray, "n"], r: Float[np.ndarray, "n"]) -> Peak:
    """Vertex of the least-squares parabola; the lag is NaN if it opens upwards."""
    centre = float(lag.mean())
    scale = float(np.ptp(lag)) / 2
    c2, c1, c0 = np.polyfit((lag - centre) / scale, r, 2)
    if not c2 < 0:
        return Peak(np.nan, float(r.max()), 0.0)
    return Peak(float(centre - scale * c1 / (2 * c2)), float(c0 - c1**2 / (4 * c2)), float(-2 * c2 / scale**2))

"""Correlation of two signals against the delay between them, and where it is highest."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float, Int
from scipy.signal import correlate

TOP = 0.8  # of the highest correlation: what is above it belongs to the top of the peak


class Peak(NamedTuple):
    """Top of a correlation."""

    lag: float
    height: float
    curvature: float  # - d2r/dlag2


def correlations(
    a: Float[np.ndarray, "n"], b: Float[np.ndarray, "m"], least: int
) -> tuple[Int[np.ndarray, "k"], Float[np.ndarray, "k"]]:
    """Pearson's r of a_i and b_{i+lag} over the samples that meet, for every lag at which at least so many do.

    Each lag has its own means and spreads: a short overlap is not taken for a low correlation. 0 where one of them is
    constant.
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
    """Half the width of the top around index `at`, in lags: the shorter way to 0.8 of its height; 1 at the end."""
    level = TOP * r[at]
    ways = []
    for side in (r[at:], r[at::-1]):
        below = np.flatnonzero(side < level)
        if len(below):
            i = below[0]
            ways.append(i - 1 + (side[i - 1] - level) / (side[i - 1] - side[i]))
    return float(min(ways, default=1.0))


def part_to_fit(height: float) -> float:
    """How much of the half width to fit: all where noise leaves no more than 0.95 of the height, else less."""
    return float(np.sqrt(np.clip(4 * (1 - height) / (1 - TOP), 0.01, 1.0)))


def parabola_top(lag: Float[np.ndarray, "n"], r: Float[np.ndarray, "n"]) -> Peak:
    """Vertex of the parabola of least squares; the lag is nan where it opens upwards."""
    centre = float(lag.mean())
    scale = float(np.ptp(lag)) / 2
    c2, c1, c0 = np.polyfit((lag - centre) / scale, r, 2)
    if not c2 < 0:
        return Peak(np.nan, float(r.max()), 0.0)
    return Peak(float(centre - scale * c1 / (2 * c2)), float(c0 - c1**2 / (4 * c2)), float(-2 * c2 / scale**2))

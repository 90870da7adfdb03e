"""Correlation of two signals over their lag, its peak, and the unknown period of a signal by autocorrelation."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from scipy.signal import correlate

from .requirements import even_step, single

_TOP = 0.8  # [highest correlation]: correlations above belong to the peak
_AGAIN = 0.9  # [highest autocorrelation]: the first peak above is the period, later ones are its multiples
_LEAST = 0.5  # least autocorrelation of a periodic signal


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
    level = _TOP * r[at]
    widths = []
    for side in (r[at:], r[at::-1]):
        below = np.flatnonzero(side < level)
        if len(below):
            i = below[0]
            widths.append(i - 1 + (side[i - 1] - level) / (side[i - 1] - side[i]))
    return float(min(widths, default=1.0))


def part_to_fit(height: float) -> float:
    """Fraction of the half width to fit: 1 for a peak of at most 0.95 (noise), less for a higher one."""
    return float(np.sqrt(np.clip(4 * (1 - height) / (1 - _TOP), 0.01, 1.0)))


def parabola_top(lag: Float[np.ndarray, "n"], r: Float[np.ndarray, "n"]) -> Peak:
    """Vertex of the least-squares parabola; the lag is NaN if it opens upwards."""
    centre = float(lag.mean())
    scale = float(np.ptp(lag)) / 2
    c2, c1, c0 = np.polyfit((lag - centre) / scale, r, 2)
    if not c2 < 0:
        return Peak(np.nan, float(r.max()), 0.0)
    return Peak(float(centre - scale * c1 / (2 * c2)), float(c0 - c1**2 / (4 * c2)), float(-2 * c2 / scale**2))


class Period(NamedTuple):
    """Period of a signal."""

    period: float  # [s]
    correlation: float  # autocorrelation at one period; 1 for a periodic signal without noise


def find_period(signal: xr.DataArray, *, minimum: float = 0.0, maximum: float = np.inf) -> Period:
    """Find the period between `minimum` and `maximum` [s] by autocorrelation.

    Each interval of lags with positive autocorrelation, except that around zero, has one peak; the period is the first
    peak within a tenth of the highest (McLeod, Wyvill, A smarter way to find pitch, ICMC 2005, with Pearson's r). It is
    refined by least-squares parabolas through the peaks at 1, 2, 4, ... periods, up to half the signal. Any waveform
    with five or more samples per period is possible; a trend hides the period: `detrend` first. Raises ValueError for
    uneven sampling, NaN, less than two periods, and no autocorrelation above 0.5.
    """
    step = even_step(signal, "find_period")
    _, x = single(signal, "find_period", least=8)
    lags, r = correlations(x, x, len(x) // 2)
    r = r[lags >= 0]
    tops = [top for top in _peaks(r) if minimum <= top.lag * step <= maximum]
    highest = max((top.height for top in tops), default=0.0)
    if highest < _LEAST:
        raise ValueError(
            f"find_period: the signal of {len(x) * step:.6g} s has no period within half of that: the highest "
            f"autocorrelation is {highest:.2f}, and {_LEAST} is needed. Take a longer stretch, detrend or smooth it."
        )
    period, height = next((top.lag, top.height) for top in tops if top.height >= _AGAIN * highest)
    multiple = 1
    while (peak := _peak_near(r, multiple * period)) is not None:
        period, multiple = peak.lag / multiple, 2 * multiple
    return Period(period * step, min(1.0, height))


def _peaks(r: Float[np.ndarray, "n"]) -> list[Peak]:
    """Peak of each positive interval within the array, in lags, interpolated between samples."""
    edges = np.diff((r > 0).astype(int))
    ups, downs = np.flatnonzero(edges > 0) + 1, np.flatnonzero(edges < 0) + 1
    downs = downs[np.searchsorted(downs, ups[0]) :] if len(ups) else downs[:0]
    highest = [up + int(np.argmax(r[up:down])) for up, down in zip(ups, downs, strict=False)]
    return [parabola_top(np.arange(i - 1.0, i + 2.0), r[i - 1 : i + 2]) for i in highest]


def _peak_near(r: Float[np.ndarray, "n"], lag: float) -> Peak | None:
    """Peak nearest to a lag; None if it is beyond the array or not clear."""
    at = round(lag)
    reach = max(1, at // 20)
    if at + reach >= len(r):
        return None
    at += int(np.argmax(r[at - reach : at + reach + 1])) - reach
    half = max(1, round(top_width(r, at) * part_to_fit(r[at])))
    if at + half >= len(r):
        return None
    near = np.arange(at - half, at + half + 1)
    peak = parabola_top(near.astype(float), r[near])
    return peak if near[0] <= peak.lag <= near[-1] else None

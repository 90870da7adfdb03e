"""The unknown period of a signal, by autocorrelation."""

from typing import NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from .correlation import Peak, correlations, parabola_top, part_to_fit, top_width
from .requirements import even_step, single

_AGAIN = 0.9  # [highest autocorrelation]: the first peak above is the period, later ones are its multiples
_LEAST = 0.5  # least autocorrelation of a periodic signal


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

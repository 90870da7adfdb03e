"""Correlation of two signals over their lag: recordings on one clock, and the unknown period of a signal."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from scipy.interpolate import CubicSpline
from scipy.signal import correlate

from .events import crossings
from .metadata import SE, with_step
from .requirements import even_step, positive, single
from .resample import between, default_gap, unbroken

_TOP = 0.8  # [highest correlation]: correlations above belong to the peak
_AGAIN = 0.9  # [highest autocorrelation]: the first peak above is the period, later ones are its multiples
_LEAST = 0.5  # least autocorrelation of a periodic signal
_POINTS = 9  # least number of points in the fit of the correlation's peak


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


class Alignment(NamedTuple):
    """A recording on the clock of another one."""

    recording: xr.Dataset
    lag: float  # [s] delay of its own clock, subtracted from its time
    lag_se: float  # [s] NaN if unknown
    correlation: float  # at that lag, 1 for the same signal; NaN for a trigger


def align(a: xr.Dataset, b: xr.Dataset, name: str, *, max_lag: float | None = None) -> Alignment:
    """Put `b` on the clock of `a`, by the lag with the highest correlation of their variables `name`.

    The recording with the wider steps keeps its samples; the other one is interpolated at them (cubic spline).
    Pearson's r is taken over the overlap, at least half of the shorter recording, at whole steps (within `max_lag` [s]
    if given). The lag is the vertex of the least-squares parabola through the peak of r, evaluated between steps. Its
    standard error, for errors independent from sample to sample,

    $$ s^2 = \\frac{1 - r^2}{N\\, r\\, (-r'')} $$

    is the Cramer-Rao bound of a delay (Kay, Fundamentals of Statistical Signal Processing, vol. 1, ex. 3.13), with the
    signal's noise and derivative from the correlation. For frequencies near half the rate, interpolation adds up to
    1/50 of a step. A periodic signal has one such lag per period: give `max_lag`. Raises ValueError for NaN, gaps, a
    constant signal, no positive correlation, and a peak at the end of the search.
    """
    ours, theirs = _Samples.of(a, name), _Samples.of(b, name)
    swapped = ours.step < theirs.step
    peak, count = _best_lag(theirs, ours, name, max_lag) if swapped else _best_lag(ours, theirs, name, max_lag)
    r = min(peak.height, 1.0)
    se = float(np.sqrt((1 - r**2) / (count * r * peak.curvature)))
    lag = -peak.lag if swapped else peak.lag
    settings = {"by": "correlation", "max_lag": max_lag, "lag": lag, "lag_se": se, "correlation": r}
    return Alignment(_shifted(b, name, lag, settings), lag, se, r)


def align_at(a: xr.Dataset, b: xr.Dataset, name: str, level: float, *, hysteresis: float = 0.0) -> Alignment:
    """Put `b` on the clock of `a`, by the first rising crossing of `level` of their variables `name` (`crossings`).

    The standard error is that of `name` over its time derivative at the crossing. A pulse with two values only rises
    anywhere between two samples: 1/sqrt(12) of the time between these. NaN where one recording has neither. Raises
    ValueError if one of them does not cross the level.
    """
    rises = []
    for recording, which in ((a, "first"), (b, "second")):
        _variable(recording, name, "align_at")
        try:
            rises.append(rise(recording, name, level, hysteresis))
        except ValueError as error:
            raise ValueError(f"align_at: of the {which} recording {error}") from None
    (time_a, se_a), (time_b, se_b) = rises
    lag, se = float(time_b - time_a), float(np.hypot(se_a, se_b))
    known = {"lag_se": se} if np.isfinite(se) else {}
    settings = {"by": "trigger", "level": level, "hysteresis": hysteresis, "lag": lag, **known}
    return Alignment(_shifted(b, name, lag, settings), lag, se, np.nan)


def rise(recording: xr.Dataset, name: str, level: float, hysteresis: float = 0.0) -> tuple[float, float]:
    """When a variable first rises through a level [s], and the standard error of that, as in `align_at`.

    Raises ValueError where it does not.
    """
    signal = recording[name]
    rises = crossings(signal, level, hysteresis=hysteresis).values
    if len(rises) == 0:
        ends = f"{float(signal.min()):g} and {float(signal.max()):g}"
        raise ValueError(f"{name} does not rise through {level:g}; it lies between {ends}.")
    return float(rises[0]), _crossing_se(recording, name, float(rises[0]))


class _Samples(NamedTuple):
    """One signal without gaps."""

    time: Float[np.ndarray, "n"]  # [s]
    values: Float[np.ndarray, "n"]
    step: float  # [s] median

    @classmethod
    def of(cls, recording: xr.Dataset, name: str) -> "_Samples":
        time, x = single(_variable(recording, name, "align"), "align", least=8)
        step, longest = float(np.median(np.diff(time))), int(np.argmax(np.diff(time)))
        if len(unbroken(time, np.ones(len(time), bool), default_gap(time))) > 1:
            raise ValueError(
                f"align: {name} has a gap from {time[longest]:.6g} s to {time[longest + 1]:.6g} s, and steps of "
                f"{step:.6g} s elsewhere: take a stretch without gaps."
            )
        return cls(time, x, step)

    def even(self, step: float) -> Float[np.ndarray, "k"]:
        """Values at equal steps from the first time on."""
        count = int((self.time[-1] - self.time[0]) / step * (1 + 1e-9)) + 1
        grid = np.minimum(self.time[0] + step * np.arange(count), self.time[-1])
        return between(self.time, self.values, grid, "cubic")


def _best_lag(a: _Samples, b: _Samples, name: str, max_lag: float | None) -> tuple[Peak, int]:
    """Correlation peak over the lag [s] of b behind a, and the samples in the overlap; a has the wider steps."""
    u, v = a.even(a.step), b.even(a.step)
    lags, r = correlations(u, v, max(8, min(len(u), len(v)) // 2))
    delays = lags * a.step + b.time[0] - a.time[0]
    if max_lag is not None:
        positive(max_lag, "max_lag", "s", "align")
        near = np.abs(delays) <= max_lag + a.step / 2
        delays, r = delays[near], r[near]
    best = int(np.argmax(r)) if len(r) else 0
    if len(r) == 0 or r[best] <= 0:
        raise ValueError(f"align: {name} of the two recordings has no positive correlation at any lag searched.")
    if best in (0, len(r) - 1):
        raise ValueError(
            f"align: the correlation of {name} is highest at the end of the search, {delays[best]:.6g} s: set a "
            "larger max_lag, or cut the recordings to a longer overlap."
        )
    peak = parabola_top(delays[best - 1 : best + 2], r[best - 1 : best + 2])
    widest = max(0.5, top_width(r, best)) * a.step
    spline, count, lag = CubicSpline(b.time, b.values), 0, np.nan
    for _ in range(4):  # the fitted part of the peak moves to its vertex; its width follows from the noise
        width = widest * part_to_fit(peak.height)
        near = np.abs(delays - peak.lag) <= width
        enough = np.count_nonzero(near) >= _POINTS  # whole steps suffice
        tried = delays[near] if enough else peak.lag + np.linspace(-width, width, _POINTS)
        inside = (a.time + tried[0] >= b.time[0]) & (a.time + tried[-1] <= b.time[-1])
        count = int(np.count_nonzero(inside))
        x, t = a.values[inside], a.time[inside]
        heights = r[near] if enough else np.array([np.corrcoef(x, spline(t + d))[0, 1] for d in tried])
        peak = parabola_top(tried, heights)
        lag, peak = peak.lag, peak._replace(lag=float(np.clip(peak.lag, tried[0], tried[-1])))
    if peak.curvature > 0 and peak.lag == lag:
        return peak, count
    raise ValueError(f"align: the correlation of {name} has no clear peak: smooth or low-pass the recordings first.")


def _crossing_se(recording: xr.Dataset, name: str, at: float) -> float:
    time, x = recording["time"].values, recording[name].values
    i = int(np.clip(np.searchsorted(time, at), 1, len(time) - 1))
    if name + SE not in recording:
        return float((time[i] - time[i - 1]) / np.sqrt(12)) if np.unique(x).size == 2 else np.nan
    slope = (x[i] - x[i - 1]) / (time[i] - time[i - 1])
    after = (at - time[i - 1]) / (time[i] - time[i - 1])
    se = recording[name + SE].broadcast_like(recording[name]).values[i - 1 : i + 1]
    return float(np.hypot((1 - after) * se[0], after * se[1]) / abs(slope))


def _shifted(b: xr.Dataset, name: str, lag: float, settings: dict[str, Any]) -> xr.Dataset:
    moved = b.assign_coords(time=("time", b["time"].values - lag, b["time"].attrs))
    return with_step(moved, "align", name=name, **settings)


def _variable(recording: xr.Dataset, name: str, function: str) -> xr.DataArray:
    if name not in recording.data_vars:
        known = ", ".join(map(str, recording.data_vars))
        raise ValueError(f"{function}: there is no {name} in one of the recordings; it has {known}.")
    return recording[name]

"""Recordings on one clock: the lag between two of them, from their correlation or from a trigger."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.interpolate import CubicSpline

from .correlation import Peak, correlations, parabola_top, part_to_fit, top_width
from .events import crossings
from .metadata import SE, with_step
from .requirements import positive, single
from .resample import between, default_gap, unbroken

_POINTS = 9  # least number of points in the fit of the correlation's peak


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
    lags = []
    for recording, which in ((a, "first"), (b, "second")):
        signal = _variable(recording, name, "align_at")
        rises = crossings(signal, level, hysteresis=hysteresis).values
        if len(rises) == 0:
            raise ValueError(
                f"align_at: {name} of the {which} recording does not rise through {level:g}; it lies between "
                f"{float(signal.min()):g} and {float(signal.max()):g}."
            )
        lags.append((rises[0], _crossing_se(recording, name, rises[0])))
    (time_a, se_a), (time_b, se_b) = lags
    lag, se = float(time_b - time_a), float(np.hypot(se_a, se_b))
    known = {"lag_se": se} if np.isfinite(se) else {}
    settings = {"by": "trigger", "level": level, "hysteresis": hysteresis, "lag": lag, **known}
    return Alignment(_shifted(b, name, lag, settings), lag, se, np.nan)


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

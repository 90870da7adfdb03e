"""Resampling of signals: interpolation between samples, never beyond the ends or across a gap."""

from typing import Literal

import numpy as np
import xarray as xr
from jaxtyping import Bool, Float
from scipy.interpolate import CubicSpline

from .filters import ZeroPhase
from .metadata import CORRELATED, R, RecordedSignal, each, errors_independent, with_step
from .noise import filtered_se
from .requirements import is_even, mean_step, positive, time_of

Method = Literal["linear", "cubic"]
_GAP = 5  # [median time step]: a longer step is a gap by default
_BAND = 0.4  # cutoff of the anti-alias filter over the new rate
_ORDER = 8  # of each pass of the anti-alias filter: it leaves 1/270 of what would alias below the cutoff


def resample(
    recording: R,
    rate: float | None = None,
    *,
    times: Float[np.ndarray, "m"] | None = None,
    method: Method = "linear",
    gap: float | None = None,
    antialias: bool = True,
) -> R:
    """Interpolate at even times of `rate` [Hz] from the first sample on, or at the given `times` [s].

    The result is NaN between samples further apart than `gap` [s] (default: 5 median steps), around NaN, and beyond the
    ends. If the new rate (for `times`: one over the median step) is lower than the old one by a tenth or more, a
    zero-phase low-pass (`ZeroPhase`, order 8, cutoff 0.4 times the new rate) is applied first, on even steps; a stretch
    without gaps that is shorter than its impulse response gives NaN; without `antialias` there is no filter. "cubic" is
    a spline through the samples of a stretch.

    Standard errors pass the filter and are interpolated linearly, which is a bound for any correlation with linear
    interpolation. Raises ValueError unless exactly one of `rate` and `times` is given, for times that do not increase,
    and if no stretch is long enough for the filter.
    """
    old = time_of(recording, "resample")
    new = _new_times(old, rate, times)
    gap = default_gap(old) if gap is None else gap
    positive(gap, "gap", "s", "resample")
    if method not in ("linear", "cubic"):
        raise ValueError(f'resample: method is "{method}"; it must be "linear" or "cubic".')
    new_rate = 1 / float(np.median(np.diff(new))) if rate is None else rate
    cutoff = _BAND * new_rate if antialias and new_rate * np.median(np.diff(old)) < 1 / 1.1 else None
    independent = errors_independent(recording)

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        shape = (*signal.values.shape[:-1], len(new))
        values = np.full(shape, np.nan)
        se = None if signal.se is None else np.full(shape, np.nan)
        stretches = 0
        for i in np.ndindex(shape[:-1]):
            for s in unbroken(old, np.isfinite(signal.values[i]), gap):
                t, x = old[s], signal.values[i][s]
                e = None if signal.se is None else signal.se[i][s]
                if cutoff is not None:
                    t, x, e = _without_alias(t, x, e, cutoff, method, independent)
                stretches += len(t) > 0
                inside = (new >= old[s][0]) & (new <= old[s][-1]) & (len(t) > 0)
                values[i][inside] = between(t, x, new[inside], method)
                if se is not None and e is not None:
                    se[i][inside] = between(t, e, new[inside], "linear")
        if cutoff is not None and not stretches:
            raise ValueError(
                f"resample: no stretch of {name} without nan and gaps above {gap:.6g} s is long enough for the "
                f"anti-alias filter at {cutoff:.6g} Hz: choose a higher rate or a larger gap."
            )
        return signal._replace(values=values, se=se)

    axis = xr.DataArray(new, dims="time", name="time", attrs=recording["time"].attrs or {"units": "s"})
    settings = {"rate": new_rate, "method": method, "gap": gap, "antialias": cutoff}
    return with_step(each(recording, change, [axis]), "resample", **settings, **CORRELATED)


def default_gap(time: Float[np.ndarray, "n"]) -> float:
    """Default time between samples [s] that counts as a gap: 5 median steps."""
    return _GAP * float(np.median(np.diff(time)))


def unbroken(time: Float[np.ndarray, "n"], valid: Bool[np.ndarray, "n"], gap: float) -> list[slice]:
    """Stretches of valid samples at most `gap` [s] apart."""
    at = np.flatnonzero(valid)
    if len(at) == 0:
        return []
    breaks = np.flatnonzero((np.diff(at) > 1) | (np.diff(time[at]) > gap * (1 + 1e-9)))
    first, last = at[np.concatenate([[0], breaks + 1])], at[np.concatenate([breaks, [len(at) - 1]])]
    return [slice(a, b + 1) for a, b in zip(first, last, strict=True)]


def between(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], new: Float[np.ndarray, "m"], method: Method
) -> Float[np.ndarray, "m"]:
    """Values of one stretch without gaps, at new times within it."""
    if len(time) == 0 or len(new) == 0:
        return np.zeros(0)
    if method == "linear" or len(time) < 3:
        return np.interp(new, time, values)
    return CubicSpline(time, values)(new)


def _new_times(
    old: Float[np.ndarray, "n"], rate: float | None, times: Float[np.ndarray, "m"] | None
) -> Float[np.ndarray, "m"]:
    if (rate is None) == (times is None):
        raise ValueError("resample: give either a rate [Hz] or times [s].")
    if rate is not None:
        positive(rate, "rate", "Hz", "resample")
        count = int(np.floor((old[-1] - old[0]) * rate * (1 + 1e-12) + 1e-9)) + 1
        new = np.minimum(old[0] + np.arange(count) / rate, old[-1])
    else:
        new = np.asarray(times, float)
    if new.ndim != 1 or len(new) < 2 or not np.all(np.diff(new) > 0):
        raise ValueError(f"resample: the new times must be two or more and increase; there are {new.size}.")
    return new


def _without_alias(
    t: Float[np.ndarray, "n"],
    x: Float[np.ndarray, "n"],
    e: Float[np.ndarray, "n"] | None,
    cutoff: float,
    method: Method,
    independent: bool,
) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"], Float[np.ndarray, "k"] | None]:
    """A low-passed stretch at even times; empty if it is too short."""
    nothing = np.zeros(0)
    if len(t) < 2:
        return nothing, nothing, nothing
    if not is_even(t):
        grid = np.linspace(t[0], t[-1], round((t[-1] - t[0]) / float(np.median(np.diff(t)))) + 1)
        t, x, e = grid, between(t, x, grid, method), None if e is None else between(t, e, grid, "linear")
    filter = ZeroPhase(cutoff, _ORDER, mean_step(t))
    if len(t) <= filter.reach:
        return nothing, nothing, nothing
    return t, filter(x), None if e is None else filtered_se(e, filter.weights, independent)

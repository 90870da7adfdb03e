"""Events in time: crossings of a level, windows in which a condition holds, strokes."""

from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from .metadata import history, with_step
from .requirements import positive, single, time_of


class Window(NamedTuple):
    """A closed interval of time; `recording.sel(time=slice(*window))` selects its samples."""

    start: float  # [s]
    end: float  # [s]


class StrokeWindow(NamedTuple):
    """A monotonic motion from one turning point to the next."""

    start: float  # [s]
    end: float  # [s]
    change: float  # of the signal, in its unit; negative for a falling signal


def crossings(
    signal: xr.DataArray,
    level: float,
    *,
    hysteresis: float = 0.0,
    direction: Literal["rising", "falling"] = "rising",
) -> xr.DataArray:
    """Times [s] at which a signal rises (falls) through `level`, along the dimension `event`.

    A rise counts if it goes from level - hysteresis / 2 or below to level + hysteresis / 2 or above; its time is the
    last crossing of the level before, by linear interpolation between samples. Noise smaller than half the hysteresis
    makes no extra crossing. Raises ValueError for NaN and a negative hysteresis.
    """
    time, x = single(signal, "crossings")
    if direction not in ("rising", "falling"):
        raise ValueError(f'crossings: direction is "{direction}"; it must be "rising" or "falling".')
    if not hysteresis >= 0:
        raise ValueError(f"crossings: hysteresis is {hysteresis:g}; it must be 0 or more.")
    x = x - level if direction == "rising" else level - x
    side = np.where(x >= hysteresis / 2, 1, np.where((x <= -hysteresis / 2) & (x < 0), -1, 0))
    decided = np.flatnonzero(side)
    rises = decided[1:][np.diff(side[decided]) > 0]  # first samples above, after some below
    through = np.flatnonzero((x[:-1] < 0) & (x[1:] >= 0))
    i = through[np.searchsorted(through, rises) - 1] if len(rises) else rises
    at = time[i] + (time[i + 1] - time[i]) * x[i] / (x[i] - x[i + 1]) if len(i) else np.zeros(0)
    found = xr.DataArray(at, dims="event", name="time", attrs={"units": "s"} | history(signal))
    return with_step(found, "crossings", level=level, hysteresis=hysteresis, direction=direction)


def windows_where(condition: xr.DataArray, minimum: float = 0.0) -> list[Window]:
    """Windows of `minimum` [s] or longer in which a condition holds, from the first such sample to the last.

    `windows_where(abs(speed) < 1e-3, 0.5)` gives the times at rest. Comparisons with NaN are false. Raises ValueError
    for a condition that is not boolean.
    """
    time = time_of(condition, "windows_where")
    if condition.dtype.kind != "b" or condition.dims != ("time",):
        raise ValueError(
            f"windows_where: the condition is {condition.dtype} over {', '.join(map(str, condition.dims))}; true and "
            "false over time are needed, as in speed > 0.1."
        )
    edges = np.diff(np.concatenate([[0], condition.values.astype(int), [0]]))
    first, last = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0) - 1
    found = [Window(float(time[a]), float(time[b])) for a, b in zip(first, last, strict=True)]
    return [window for window in found if window.end - window.start >= minimum * (1 - 1e-9)]


def strokes(signal: xr.DataArray, excursion: float) -> list[StrokeWindow]:
    """Strokes of at least `excursion` [the signal's unit] between turning points.

    A turning point is an extreme after which the signal reverses by the excursion or more; smaller reversals belong to
    the stroke they are in. The first stroke starts at the extreme before it, the last one ends at the last extreme. No
    strokes for a smaller motion. Raises ValueError for NaN and an excursion that is not positive.
    """
    positive(excursion, "excursion", str(signal.attrs.get("units", "")), "strokes")
    time, x = single(signal, "strokes")
    turns = _turning_points(x, excursion)
    return [StrokeWindow(float(time[a]), float(time[b]), float(x[b] - x[a])) for a, b in pairwise(turns)]


def _turning_points(x: Float[np.ndarray, "n"], excursion: float) -> list[int]:
    """Indices of the extremes between which a signal moves by `excursion` or more."""
    local = np.flatnonzero(np.diff(np.sign(np.diff(x)), prepend=2, append=2)) if len(x) > 1 else np.zeros(0, int)
    values = x[local].tolist()
    turns: list[int] = []
    low = high = direction = 0
    for i, value in enumerate(values):
        if value > values[high]:
            high = i
        if value < values[low]:
            low = i
        if direction <= 0 and value - values[low] >= excursion:
            turns.append(low)
            direction, high = 1, i
        elif direction >= 0 and values[high] - value >= excursion:
            turns.append(high)
            direction, low = -1, i
    return local[[*turns, high if direction > 0 else low]].tolist() if turns else []

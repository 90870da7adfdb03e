"""Events in time: crossings of a level, peaks, windows in which a condition holds, strokes; runs of a long log."""

from collections.abc import Sequence
from itertools import pairwise
from typing import Literal, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from scipy.signal import find_peaks

from .metadata import history, units, with_step
from .requirements import even_step, positive, single, time_of


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
    times = xr.DataArray(at, dims="event", name="time", attrs={"units": "s"} | history(signal))
    return with_step(times, "crossings", level=level, hysteresis=hysteresis, direction=direction)


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
    windows = [Window(float(time[a]), float(time[b])) for a, b in zip(first, last, strict=True)]
    return [window for window in windows if window.end - window.start >= minimum * (1 - 1e-9)]


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


def peaks(signal: xr.DataArray, prominence: float, *, distance: float = 0.0) -> xr.Dataset:
    """Maxima of at least `prominence` [the signal's unit], `distance` [s] or more apart, along `peak`.

    `time` [s] and `height` are those of the vertex of the parabola through the highest sample and its neighbours (of
    the sample itself on a flat top). `prominence` is scipy's: the drop on both sides before the signal gets higher.
    Minima are the peaks of -signal. The first and last sample are not peaks. Raises ValueError for NaN, and for uneven
    sampling with a `distance`.
    """
    time, x = single(signal, "peaks", least=3)
    positive(prominence, "prominence", units(signal) or "", "peaks")
    apart = max(1.0, distance / even_step(signal, "peaks")) if distance > 0 else None
    indices, about = find_peaks(x, prominence=prominence, distance=apart)
    at, height = _vertices(time, x, indices)
    unit = {"units": units(signal)} if units(signal) is not None else {}
    maxima = xr.Dataset(
        {
            "time": ("peak", at, {"units": "s"}),
            "height": ("peak", height, unit),
            "prominence": ("peak", about["prominences"], unit),
        },
        attrs=history(signal),
    )
    return with_step(maxima, "peaks", prominence=prominence, distance=distance)


def _vertices(
    time: Float[np.ndarray, "n"], x: Float[np.ndarray, "n"], at: Int[np.ndarray, "k"]
) -> tuple[Float[np.ndarray, "k"], Float[np.ndarray, "k"]]:
    """Vertex of the parabola through three samples of any spacing, by divided differences."""
    t0, t1, t2 = time[at - 1], time[at], time[at + 1]
    left, right = (x[at] - x[at - 1]) / (t1 - t0), (x[at + 1] - x[at]) / (t2 - t1)
    bend = (right - left) / (t2 - t0)
    round_top = bend < 0
    safe = np.where(round_top, bend, -1.0)
    slope = left + bend * (t1 - t0)  # at t1
    shift = np.where(round_top, -slope / (2 * safe), 0.0)
    return t1 + shift, x[at] + np.where(round_top, slope * shift + bend * shift**2, 0.0)


def split(recording: xr.Dataset, windows: Sequence[Window | StrokeWindow]) -> list[xr.Dataset]:
    """Part of the recording in each window, both ends included. Raises ValueError for a window without samples."""
    parts = []
    for i, window in enumerate(windows):
        part = recording.sel(time=slice(window.start, window.end))
        if part.sizes["time"] == 0:
            raise ValueError(
                f"split: window {i}, from {window.start:g} s to {window.end:g} s, has no sample; the recording lasts "
                f"from {float(recording.time[0]):g} s to {float(recording.time[-1]):g} s."
            )
        parts.append(with_step(part, "split", start=float(window.start), end=float(window.end)))
    return parts


def split_at_idle(recording: xr.Dataset, idle: xr.DataArray, minimum: float) -> list[xr.Dataset]:
    """Runs between idle times: windows of `minimum` [s] or longer in which the condition `idle` holds.

    `split_at_idle(log, abs(log.speed) < 1e-3, 2.0)`; a run may contain shorter pauses. Raises ValueError for a
    condition that is not boolean over the recording's time.
    """
    if idle.sizes.get("time") != recording.sizes["time"]:
        raise ValueError(
            f"split_at_idle: the condition has {idle.sizes.get('time', 0)} samples; it needs the "
            f"{recording.sizes['time']} of the recording."
        )
    time = recording["time"].values
    active = np.ones(len(time), bool)
    for window in windows_where(idle, minimum):
        active &= (time < window.start) | (time > window.end)
    return split(recording, windows_where(idle.copy(data=active)))


def split_at_resets(recording: xr.Dataset) -> list[xr.Dataset]:
    """Parts with increasing time: a new one starts wherever time decreases, as after a restart of the log.

    Raises ValueError for equal times, since their order is unknown.
    """
    time = recording["time"].values.astype(float)
    steps = np.diff(time)
    still = np.flatnonzero((steps == 0) | np.isnan(steps))
    if len(still):
        i = still[0]
        raise ValueError(
            f"split_at_resets: time is {time[i]:.9g} s and {time[i + 1]:.9g} s in samples {i} and {i + 1}; it must "
            "increase or decrease: drop one of the two with isel."
        )
    edges = [0, *(np.flatnonzero(steps < 0) + 1), len(time)]
    return [
        with_step(recording.isel(time=slice(a, b)), "split_at_resets", part=i)
        for i, (a, b) in enumerate(pairwise(edges))
    ]

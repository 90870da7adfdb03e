"""Splitting of a long log into runs."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import xarray as xr

from .events import StrokeWindow, Window, windows_where
from .metadata import with_step


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
    still = np.flatnonzero(~(steps != 0) | np.isnan(steps))
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

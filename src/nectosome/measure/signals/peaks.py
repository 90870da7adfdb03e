"""Peaks of a signal, between samples."""

import numpy as np
import xarray as xr
from jaxtyping import Float, Int
from scipy.signal import find_peaks

from .metadata import history, units, with_step
from .requirements import even_step, positive, single


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
    found = xr.Dataset(
        {
            "time": ("peak", at, {"units": "s"}),
            "height": ("peak", height, unit),
            "prominence": ("peak", about["prominences"], unit),
        },
        attrs=history(signal),
    )
    return with_step(found, "peaks", prominence=prominence, distance=distance)


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

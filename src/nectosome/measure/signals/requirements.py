"""Requirements of signals before processing; each error names the value, what is allowed, and the remedy."""

import numpy as np
import xarray as xr
from jaxtyping import Float

UNEVEN = 0.01  # largest deviation of a time step from the mean one that still counts as even [-]


def time_of(recording: xr.Dataset | xr.DataArray, function: str, least: int = 2) -> Float[np.ndarray, "n"]:
    """Times of a recording [s]. Raises ValueError for no time, too few samples, or times that do not increase."""
    if "time" not in recording.dims or "time" not in recording.coords:
        raise ValueError(
            f"{function}: there is no time; a dimension and a coordinate of that name are needed. The dimensions are "
            f"{', '.join(map(str, recording.dims)) or 'none'}."
        )
    time = recording["time"].values.astype(float)
    if len(time) < least:
        raise ValueError(f"{function}: there are {len(time)} samples; at least {least} are needed.")
    bad = np.flatnonzero(~(np.diff(time) > 0))
    if len(bad):
        i = bad[0]
        raise ValueError(
            f"{function}: time goes from {time[i]:.9g} s to {time[i + 1]:.9g} s at sample {i + 1}, and it must "
            "increase: split the recording with split_at_resets, or drop repeated samples."
        )
    return time


def mean_step(time: Float[np.ndarray, "n"]) -> float:
    """Mean sampling interval [s]."""
    return float((time[-1] - time[0]) / (len(time) - 1))


def is_even(time: Float[np.ndarray, "n"]) -> bool:
    """Whether all time steps equal the mean one within 1 %."""
    step = mean_step(time)
    return bool(np.all(np.abs(np.diff(time) - step) <= UNEVEN * step))


def even_step(recording: xr.Dataset | xr.DataArray, function: str) -> float:
    """Sampling interval [s]. Raises ValueError if it varies by more than 1 %."""
    time = time_of(recording, function)
    if not is_even(time):
        steps = np.diff(time)
        raise ValueError(
            f"{function}: samples are {steps.min():.6g} s to {steps.max():.6g} s apart, and even steps are needed "
            f"(within 1 %): resample first, for instance at {1 / np.median(steps):.6g} Hz."
        )
    return mean_step(time)


def refuse_nan(values: Float[np.ndarray, "*batch n"], name: str, time: Float[np.ndarray, "n"], function: str) -> None:
    """Raise ValueError for values that are not finite."""
    bad = ~np.isfinite(values)
    if bad.any():
        first = time[np.flatnonzero(bad.reshape(-1, bad.shape[-1]).any(axis=0))[0]]
        raise ValueError(
            f"{function}: {name} has {np.count_nonzero(bad)} values that are NaN or infinite, the first at "
            f"{first:.6g} s, and none is allowed: take a stretch without them, as found by windows_where(x.notnull())."
        )


def single(
    signal: xr.DataArray, function: str, least: int = 2
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Times [s] and values of one signal. Raises ValueError for more dimensions than time, NaN, or too few samples."""
    time = time_of(signal, function, least)
    if signal.dims != ("time",):
        others = ", ".join(str(dim) for dim in signal.dims if dim != "time")
        raise ValueError(f"{function}: the signal has dimensions beside time ({others}): select one with isel.")
    values = signal.values.astype(float)
    refuse_nan(values, str(signal.name or "the signal"), time, function)
    return time, values


def positive(value: float, name: str, unit: str, function: str) -> None:
    """Raise ValueError for a setting that is not a positive number."""
    if not (np.isfinite(value) and value > 0):
        raise ValueError(f"{function}: {name} is {value:g} {unit}; it must be a positive number.")

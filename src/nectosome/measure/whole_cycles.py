"""The part of a recording that counts, cut into whole cycles, and means over them."""

import json
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, read_quantity, shorten
from nectosome.units.ranges import split_range

from .labels import unit_of
from .signals import regular_starts, split_cycles
from .signals.features import mean_of_samples

if TYPE_CHECKING:
    import xarray as xr

_FREQUENCY = "f"  # the condition that is the frequency of a cycle
_SAMPLES = 8  # of a cycle, at least: fewer give neither its mean nor its peak
_SLACK = 1e-3  # by which a count of samples or cycles may be short of a whole number: written times are rounded


def within_window(recording: "xr.Dataset", file: str) -> "xr.Dataset":
    """What was recorded within its window, if it has one. Raises InputError for one without readings."""
    text = json.loads(recording.attrs.get("window", "null"))
    if text is None:
        return recording
    ends = split_range(text)
    if ends is None or ends.step or ends.log:
        why = f'"{shorten(text)}" is no window. Write two times, as in "1.5..11.5 s".'
        raise InputError(why, file=file, field="window")
    low, high = (read_quantity(end, "time", "window") for end in (ends.low, ends.high))
    time = recording["time"].values
    within = (time >= low - _SLACK) & (time <= high + _SLACK)
    if not within.any():
        why = f"{shorten(text)} has no readings, which go from {time[0]:.6g} to {time[-1]:.6g} s."
        raise InputError(why, file=file, field="window")
    return recording.isel(time=within)


def frequency_of(recording: "xr.Dataset") -> float | None:
    """Frequency of the cycles [Hz], the condition f; None of a recording that has none."""
    given = recording.coords.get(_FREQUENCY)
    cyclic = given is not None and given.ndim == 0 and float(given) > 0 and unit_of(given) == "Hz"
    return float(given) if given is not None and cyclic else None


def whole_cycles(recording: "xr.Dataset", frequency: float, file: str) -> "tuple[xr.Dataset, list[str]]":
    """The cycles that are wholly there, over `cycle` and `phase`, and what was left out: of three or more the first.

    Raises ValueError for less than a cycle, and for too few samples in one.
    """
    time = recording["time"].values
    step = float(np.median(np.diff(time)))
    samples, whole = (int(x + _SLACK) for x in (1 / (frequency * step), (time[-1] - time[0] + step) * frequency))
    if whole < 1:
        raise ValueError(f"lasts {time[-1] - time[0]:.4g} s, less than a cycle of {1 / frequency:.4g} s.")
    if samples < _SAMPLES:
        raise ValueError(f"has {samples} samples a cycle; at least {_SAMPLES} are needed.")
    cycles = split_cycles(recording, regular_starts(recording, 1 / frequency), samples=samples)
    n = cycles.sizes["cycle"]
    notes = [f"{file}: {whole - n} of {whole} cycles left out, which are not wholly there"] if n < whole else []
    if n >= 3 and int(cycles["cycle"][0]) == 0:
        cycles = cycles.isel(cycle=slice(1, None))
        notes.append("the first cycle of recordings with three or more is left out, as start-up")
    return cycles, notes


def over_cycles(values: Float[np.ndarray, "c"]) -> tuple[float, float]:
    """Mean over cycles and its standard error, as of correlated cycles; NaN for a single one."""
    if len(values) < 2:
        return float(values[0]), np.nan
    return mean_of_samples(np.arange(float(len(values))), values)

"""One recording as numbers: its conditions, and the mean and peak of a quantity over its cycles."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.io import InputError, did_you_mean
from nectosome.io.units import shown_unit
from nectosome.measure.signals import lowpass as low_passed
from nectosome.measure.signals import mean as mean_of
from nectosome.measure.signals import regular_starts, split_cycles

if TYPE_CHECKING:
    import xarray as xr

_FREQUENCY = "f"  # the condition that tells how often a motion repeats itself
_SAMPLES = 8  # of a cycle, at least: fewer tell neither its mean nor its peak
_SLACK = 1e-3  # by which a count of samples or cycles may be short of a whole number: written times are rounded


@dataclass(frozen=True)
class Recorded:
    """Numbers of one recording, in SI units."""

    file: str
    conditions: Mapping[str, float]
    mean: float
    error: float  # standard error from the scatter within it; NaN where nothing tells it
    peak: float  # largest magnitude of a cycle, mean over cycles
    peak_error: float
    seconds: float
    notes: tuple[str, ...]  # what was left out


def recorded(recording: "xr.Dataset", simulated: "xr.DataArray", column: str, lowpass: float | None) -> Recorded:
    """Numbers of a column of a recording at conditions of a simulated grid. Raises InputError that names the file."""
    about = json.loads(recording.attrs["provenance"])
    file = Path(about["file"]).name
    if column not in recording.data_vars:
        near = did_you_mean(column, map(str, recording.data_vars))
        raise InputError(f'has no column called "{column}".{near}', file=file)
    if "time" not in recording.dims:
        raise InputError("has no time, without which nothing is known of means over time.", file=file)
    signal = recording[column].compute()
    _same_unit(signal, simulated, file, column)
    conditions = _conditions(recording, simulated, file)
    told = recording.coords.get(_FREQUENCY)  # also where the grid has a single one
    cyclic = told is not None and told.ndim == 0 and float(told) > 0 and unit_of(told) == "Hz"
    time = signal["time"].values
    try:
        numbers = _numbers(signal, float(told) if told is not None and cyclic else None, lowpass, file)
    except ValueError as error:
        raise InputError(str(error), file=file, field=column) from None
    said = [f"{file}: {note}" for note in (*about["repairs"], *about["odd"]) if _concerns(note, recording, column)]
    return Recorded(file, conditions, *numbers[:-1], float(time[-1] - time[0]), (*said, *numbers[-1]))


def _concerns(note: str, recording: "xr.Dataset", column: str) -> bool:
    """Whether what is odd about a recording is not odd about another of its columns."""
    return not any(note.startswith(f"{name}: ") for name in recording.data_vars if name != column)


def unit_of(quantity: "xr.DataArray") -> str:
    """SI unit of a quantity; of several ways to write one always the same."""
    unit = str(quantity.attrs.get("units", ""))
    return {"1": "", "s-1": "Hz", "1/s": "Hz"}.get(unit, unit)


def _same_unit(measured: "xr.DataArray", simulated: "xr.DataArray", file: str, name: str) -> None:
    ours, theirs = unit_of(measured) or "no unit", unit_of(simulated) or "no unit"
    if ours != theirs:
        raise InputError(f"is in {ours}, what is simulated in {theirs}: not of one kind.", file=file, field=name)


def _conditions(recording: "xr.Dataset", simulated: "xr.DataArray", file: str) -> dict[str, float]:
    """Conditions of a recording, in the order of the grid's dimensions. Raises InputError where they do not fit it."""
    told = {str(name): value for name, value in recording.coords.items() if value.ndim == 0 and name != "repeat"}
    dims = [str(dim) for dim in simulated.dims]
    for name in [*dims, *told]:
        if name not in told:
            what = "is a dimension of the simulated grid, and no condition tells it"
            raise InputError(f"{what}. Write it into the campaign.", file=file, field=name)
        if name not in simulated.coords:
            what = f"is no dimension of the simulated grid, which has {', '.join(dims)}"
            raise InputError(f"{what}. Simulate several values of it, or leave it out.", file=file, field=name)
        _same_unit(told[name], simulated[name], file, name)
        low, high, value = float(simulated[name].min()), float(simulated[name].max()), float(told[name])
        slack = 1e-9 * max(abs(low), abs(high))
        if not low - slack <= value <= high + slack:
            factor, unit = shown_unit(unit_of(simulated[name]))
            value, low, high = (f"{factor * x:.6g} {unit}".strip() for x in (value, low, high))
            what = f"{value} is outside of the simulated grid, which goes from {low} to {high}"
            raise InputError(f"{what}. Simulate a wider grid, or leave this recording out.", file=file, field=name)
    return {name: float(told[name]) for name in dims}


def _numbers(
    signal: "xr.DataArray", frequency: float | None, lowpass: float | None, file: str
) -> tuple[float, float, float, float, tuple[str, ...]]:
    """Mean and peak with their standard errors, and what was left out. Raises ValueError where nothing is left.

    For the low pass a straight line stands where values are missing.
    """
    time, known, top = signal["time"].values, np.isfinite(signal.values), signal
    if known.sum() < 2:
        raise ValueError(f"has {known.sum()} samples with a value.")
    if lowpass is not None:
        filled = np.interp(time, time[known], signal.values[known])
        top = low_passed(signal.copy(data=filled), lowpass).where(known)
    if frequency is None:
        value, se = mean_of(signal[known])
        left = () if known.all() else (f"{file}: {np.sum(~known)} missing values left out",)
        return value, se, float(np.nanmax(np.abs(top))), np.nan, left
    step = float(np.median(np.diff(time)))
    samples, whole = (int(x + _SLACK) for x in (1 / (frequency * step), (time[-1] - time[0] + step) * frequency))
    if whole < 1:
        raise ValueError(f"lasts {time[-1] - time[0]:.4g} s, less than a cycle of {1 / frequency:.4g} s.")
    if samples < _SAMPLES:
        raise ValueError(f"has {samples} samples a cycle; at least {_SAMPLES} are needed.")
    both = signal.to_dataset(name="signal").assign(top=top)
    cycles = split_cycles(both, regular_starts(both, 1 / frequency), samples=samples)
    n = cycles.sizes["cycle"]
    notes = [f"{file}: {whole - n} of {whole} cycles left out, which are not wholly there"] if n < whole else []
    if n >= 3 and int(cycles["cycle"][0]) == 0:
        cycles = cycles.isel(cycle=slice(1, None))
        notes.append("the first cycle of recordings with three or more is left out, as start-up")
    means, peaks = cycles["signal"].mean("phase").values, abs(cycles["top"]).max("phase").values
    return *_mean(means), *_mean(peaks), tuple(notes)


def _mean(values: Float[np.ndarray, "c"]) -> tuple[float, float]:
    """Mean over cycles and its standard error, as of cycles that hang together; NaN for a single one."""
    if len(values) < 2:
        return float(values[0]), np.nan
    import xarray as xr

    return mean_of(xr.DataArray(values, {"time": np.arange(float(len(values)))}, "time"))

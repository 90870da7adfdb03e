"""Recordings of pressure and displacement as `identify_hysteresis` takes them: at even times, from rest, unbroken."""

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.io import InputError
from nectosome.io.errors import count
from nectosome.measure.signals.checks import is_even
from nectosome.measure.signals.resample import default_gap, unbroken

from .hysteresis import PressureTrial

if TYPE_CHECKING:
    import xarray as xr

_UNITS = {"pressure": "Pa", "displacement": "m"}
_REST = 0.1  # of the range of the displacement: as far from 0 it does not begin at rest
_LEAST = 50  # samples


class PressureRecording(NamedTuple):
    """A trial, and what was done to the recording."""

    trial: PressureTrial
    notes: tuple[str, ...]
    file: str


def pressure_recordings(recordings: "Sequence[xr.Dataset]") -> list[PressureRecording]:
    """Trials of files that have a `pressure` [Pa] and a `displacement` [m].

    Times that are not even are made so. What follows a gap is left out, since hysteresis remembers what came in it.
    Raises InputError that names file and column for what is missing, constant, swapped or in another unit, for a
    displacement that does not begin near 0, and where too little is left.
    """
    found = [_recording(recording) for recording in recordings]
    if not found:
        raise InputError("there is no recording.", field="recordings")
    return found


def _recording(recording: "xr.Dataset") -> PressureRecording:
    file = Path(json.loads(recording.attrs["provenance"])["file"]).name
    time, columns = _columns(file, recording)
    known = np.all([np.isfinite(x) for x in columns.values()], axis=0)
    if known.sum() < _LEAST:
        raise InputError(f"has {count(int(known.sum()), 'sample')} of both; {_LEAST} at least are needed.", file=file)
    first = unbroken(time, known, default_gap(time[known]))[0]
    kept = np.flatnonzero(known)[: first.stop - first.start] if known[0] else np.zeros(0, int)
    if kept.size < _LEAST:
        raise InputError(
            f"has {count(kept.size, 'sample')} before its first gap; {_LEAST} at least are needed, since hysteresis "
            "remembers what came in the gap.",
            file=file,
        )
    notes = list[str]()
    if kept.size < time.size:
        notes.append(f"{time.size - kept.size} of {time.size} samples left out, from the first gap on")
    time, columns = time[kept], {name: x[kept] for name, x in columns.items()}
    step = float(np.mean(np.diff(time)))
    if not is_even(time):
        step = float(np.median(np.diff(time)))
        even = np.arange(time[0], time[-1] + 1e-9 * step, step)
        columns = {name: np.interp(even, time, x) for name, x in columns.items()}
        notes.append(f"put on even steps of {step:.4g} s")
    for name, x in columns.items():
        if np.ptp(x) == 0:
            raise InputError("is the same all the time: nothing can be told from it.", file=file, field=name)
    begun, width = float(columns["displacement"][0]), float(np.ptp(columns["displacement"]))
    if abs(begun) > _REST * width:
        raise InputError(
            f"begins at {begun:.4g} m, of a range of {width:.4g} m. It must begin at rest, near 0: give its zero in "
            "the campaign, as in columns: {displacement: {zero: ...}}.",
            file=file,
            field="displacement",
        )
    return PressureRecording(PressureTrial(Path(file).stem, step, **columns), tuple(notes), file)


def _columns(file: str, recording: "xr.Dataset") -> tuple[Float[np.ndarray, "n"], dict[str, Float[np.ndarray, "n"]]]:
    """Times, and both columns in SI units."""
    if "time" not in recording.dims:
        raise InputError("has no time. Say in the campaign which column it is, or its rate.", file=file)
    for name in _UNITS:
        if name not in recording.data_vars:
            there = ", ".join(map(str, recording.data_vars))
            how = f"Name the column in the campaign, as in columns: {{{name}: {{column: ..., unit: ...}}}}"
            raise InputError(f"is missing; there are {there}. {how}.", file=file, field=name)
    units = {name: str(recording[name].attrs.get("units", "")) for name in _UNITS}
    if units == {"pressure": "m", "displacement": "Pa"}:
        raise InputError("pressure is in m and displacement in Pa: the two columns are swapped.", file=file)
    for name, unit in units.items():
        if unit != _UNITS[name]:
            told = f"is in {unit or 'no unit'}; {_UNITS[name]} or a multiple is needed. Give its unit in the campaign."
            raise InputError(told, file=file, field=name)
    return recording["time"].values.astype(float), {name: recording[name].values.astype(float) for name in _UNITS}

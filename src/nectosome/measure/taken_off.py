"""What a sheet takes off the readings of a quantity: hum of a named frequency, then what its sensor reads at rest."""

from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .sheet import Sheet
from .sheet_values import Stretch

if TYPE_CHECKING:
    import xarray as xr


def take_off(recording: "xr.Dataset", sheet: Sheet, file: str) -> list[str]:
    """Take both off the quantities of a recording, in place; notes of that. Raises InputError where none is found."""
    notes = list[str]()
    for name, entry in sheet.columns.items():
        if name not in recording or not (entry.notch or entry.at_rest):
            continue
        field = f"columns.{name}.{'notch' if entry.notch else 'at_rest'}"
        if "time" not in recording.dims:
            raise InputError("needs a time, and there is none. Write time:, too.", file=file, field=field)
        if entry.notch and entry.clock is not None:
            why = f"is for quantities of the time of the file, and this one has the clock {entry.clock}."
            raise InputError(f"{why} Give its device a file of its own, under beside.", file=file, field=field)
        time, values, attributes = recording["time"].values, recording[name].values, dict(recording[name].attrs)
        unit = str(attributes["units"])
        try:
            hum, said = _hum(time, values, entry.notch, unit)
            field = f"columns.{name}.at_rest"
            zero, zeros = _zero(time, values - hum, entry.at_rest)
        except ValueError as error:
            raise InputError(str(error), file=file, field=field) from None
        moved = values - hum - zero
        ends = {"minimum": np.nanmin(moved), "maximum": np.nanmax(moved), "mean": np.nanmean(moved)}
        recording[name] = ("time", moved, attributes | {key: float(x) for key, x in ends.items()})
        notes += [f"{name}: minus hum of {what}" for what in said]
        if zeros:
            notes.append(f"{name}: minus what it reads at rest, {', '.join(f'{x:.6g} {unit}'.strip() for x in zeros)}")
    return notes


def _hum(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], frequencies: tuple[float, ...], unit: str
) -> tuple[Float[np.ndarray, "n"], list[str]]:
    """Hum of some frequencies, one after another, and how large each is, in words. Raises ValueError as `hum_of`."""
    from .signals.hum import hum_of, looks_like

    total, said = np.zeros_like(time), list[str]()
    for frequency in frequencies:
        hum = hum_of(time, values - total, frequency)
        total, seen = total + hum, looks_like(time, frequency)
        as_which = "" if np.isclose(seen, frequency) else f", which looks like {seen:.3g} Hz at this sampling rate"
        size = f"{np.sqrt(2 * np.mean(hum**2)):.3g} {unit}".strip()
        said.append(f"{frequency:g} Hz, {size} of amplitude{as_which}")
    return total, said


def _zero(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], stretches: tuple[Stretch, ...]
) -> tuple[Float[np.ndarray, "n"], list[float]]:
    """Readings at rest, linear between stretches, and their means. Raises ValueError for one without a reading."""
    if not stretches:
        return np.zeros_like(time), []
    means = list[tuple[float, float]]()
    for low, high in stretches:
        begin = time[-1] if low < 0 else time[0]
        inside = (time >= begin + low) & (time <= begin + high) & np.isfinite(values)
        if not inside.any():
            why = f"has no reading from {begin + low:.6g} to {begin + high:.6g} s"
            raise ValueError(f"{why}; it is from {time[0]:.6g} to {time[-1]:.6g} s.")
        means.append((float(time[inside].mean()), float(values[inside].mean())))
    at, zeros = zip(*sorted(means), strict=True)
    return np.interp(time, at, zeros), list(zeros)

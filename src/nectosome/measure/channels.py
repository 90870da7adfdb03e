"""From columns of a file to quantities: the column of each, and the conversion of its readings to SI."""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, did_you_mean, shorten, unit_to_si

from .formats.headings import is_time
from .formats.source import Column
from .sheet import Sheet, SheetEntry, Time


@dataclass(frozen=True)
class Channel:
    """A quantity of a column: slope * cell + shift [SI]."""

    name: str
    index: int  # of the column
    unit: str  # SI, or the file's if it is an unknown unit
    slope: float
    shift: float
    low: float = -np.inf  # cells at or beyond are saturated
    high: float = np.inf
    about: str = ""
    source: str = ""  # name in the file
    conversion: str = ""  # in words

    def convert(self, cells: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Quantity [SI] of cells in the file's unit."""
        return self.slope * cells + self.shift if (self.slope, self.shift) != (1.0, 0.0) else cells


def find_time(columns: tuple[Column, ...], time: Time | None, file: str) -> tuple[Channel | None, str]:
    """Channel of the time, and what was assumed. None: the file has no time.

    Without a sheet it is the first column whose name means time.
    """
    if time is not None and (time.absent or time.rate is not None):
        return None, f"time from the sampling rate of {time.rate:g} Hz" if time.rate is not None else ""
    if time is not None:
        index = _index(columns, time.column, "time", file)
        unit = time.unit or columns[index].unit
    else:
        named = [i for i, column in enumerate(columns) if is_time(column.name)]
        if not named:
            return None, "no column is called time: name it in a sheet"
        index, unit = named[0], columns[named[0]].unit
    assumed = ""
    if not unit:
        unit, assumed = "s", f"{columns[index].name} has no unit: taken as seconds"
    try:
        factor, si = unit_to_si(unit)
    except ValueError as error:
        raise InputError(f'"{shorten(unit)}" {error}. A unit of time is needed.', file=file, field="time") from None
    if si != "s":
        raise InputError(f'"{shorten(unit)}" is not a unit of time, as in "ms".', file=file, field="time")
    return Channel("time", index, "s", factor, 0.0, source=columns[index].name, conversion=_factor(unit, "s")), assumed


def find_channels(columns: tuple[Column, ...], time: int | None, sheet: Sheet, file: str) -> list[Channel]:
    """Channels of a sheet; without columns in it, of all columns but the time. Raises InputError."""
    if not sheet.columns:
        # netCDF forbids slashes in names
        names = [column.name.strip().replace("/", " per ") or "unnamed" for column in columns]
        return [_unchanged(names[i], i, column) for i, column in enumerate(columns) if i != time]
    return [_channel(name, entry, columns, file) for name, entry in sheet.columns.items()]


def _channel(name: str, entry: SheetEntry, columns: tuple[Column, ...], file: str) -> Channel:
    index = _index(columns, entry.column if entry.column is not None else name, name, file)
    column = columns[index]
    in_file = column.unit
    if entry.unit is not None and in_file and not _same(entry.unit, in_file):
        raise InputError(
            f"is in {in_file} in the file and in {entry.unit} in the sheet. Leave the unit out of the sheet, or "
            "correct it there.",
            file=file,
            field=name,
        )
    unit = entry.unit if entry.unit is not None else in_file
    if entry.unit is None and not entry.zero and entry.gain is None and entry.range is None:
        unchanged = _unchanged(name, index, column)
        return replace(unchanged, slope=entry.sign * unchanged.slope, about=entry.about)
    try:
        factor, si = unit_to_si(unit)
        gain, result = 1.0, si
        if entry.gain is not None:
            gain, text = entry.gain
            result = unit_to_si(f"({text}) * ({unit})" if text and unit else text or unit)[1]
    except ValueError as error:
        raise InputError(f'"{shorten(unit)}" {error}.', file=file, field=name) from None
    low, high = (end / factor for end in entry.range or (-np.inf, np.inf))
    slope = entry.sign * gain
    steps = [_factor(unit, si)] if factor != 1 else []
    steps += [f"minus {entry.zero:g} {si}"] if entry.zero else []
    steps += [f"times {slope:g}"] if slope != 1 else []
    shift = -slope * entry.zero
    return Channel(name, index, result, slope * factor, shift, low, high, entry.about, column.name, ", ".join(steps))


def _unchanged(name: str, index: int, column: Column) -> Channel:
    """Channel of a column without a sheet, in SI if its unit is known."""
    try:
        factor, si = unit_to_si(column.unit)
        conversion = _factor(column.unit, si) if factor != 1 else ""
    except ValueError:
        factor, si, conversion = 1.0, column.unit, f"unknown unit {column.unit}: not converted"
    return Channel(name, index, si, factor, 0.0, source=column.name, conversion=conversion)


def _factor(unit: str, si: str) -> str:
    return f"{unit} to {si or '1'}" if unit != si else ""


def _same(a: str, b: str) -> bool:
    try:
        return unit_to_si(a) == unit_to_si(b)
    except ValueError:
        return False


def _index(columns: tuple[Column, ...], chosen: int | str | None, field: str, file: str) -> int:
    names = [column.name for column in columns]
    if isinstance(chosen, int):
        if chosen > len(columns):
            raise InputError(f"there is no column {chosen}: the file has {len(columns)}.", file=file, field=field)
        return chosen - 1
    if chosen not in names:
        raise InputError(
            f'there is no column called "{shorten(chosen)}".{did_you_mean(str(chosen), names)}', file=file, field=field
        )
    return names.index(chosen)

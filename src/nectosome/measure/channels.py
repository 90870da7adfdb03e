"""From columns of a file to quantities: which column, and how its reading becomes an SI number."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, did_you_mean, shorten, unit_to_si

from .formats.headings import is_time
from .formats.source import Column
from .sheet import Sheet, SheetEntry, Time


@dataclass(frozen=True)
class Channel:
    """A quantity made of a column: slope * cell + shift [SI]."""

    name: str
    index: int  # of the column
    unit: str  # SI, or as the file says where that is no unit known here
    slope: float
    shift: float
    low: float = -np.inf  # cells at or beyond are saturated
    high: float = np.inf
    about: str = ""
    source: str = ""  # name in the file
    said: str = ""  # what was done to it

    def convert(self, cells: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Quantity of cells as the file has them."""
        return self.slope * cells + self.shift if (self.slope, self.shift) != (1.0, 0.0) else cells


def find_time(columns: tuple[Column, ...], time: Time | None, file: str) -> tuple[Channel | None, str]:
    """Channel of the time, and what was taken for granted. None: the file has none.

    Without a sheet it is the column that is called so; of several the first.
    """
    if time is not None and (time.absent or time.rate is not None):
        return None, f"time from the rate of {time.rate:g} Hz" if time.rate is not None else ""
    if time is not None:
        index = _place(columns, time.column, "time", file)
        unit = time.unit or columns[index].unit
    else:
        named = [i for i, column in enumerate(columns) if is_time(column.name)]
        if not named:
            return None, "no column is called time: say in a sheet which one it is"
        index, unit = named[0], columns[named[0]].unit
    said = ""
    if not unit:
        unit, said = "s", f"{columns[index].name} has no unit: taken as seconds"
    try:
        factor, si = unit_to_si(unit)
    except ValueError as error:
        raise InputError(f'"{shorten(unit)}" {error}. A unit of time is needed.', file=file, field="time") from None
    if si != "s":
        raise InputError(f'"{shorten(unit)}" is no unit of time, as in "ms".', file=file, field="time")
    return Channel("time", index, "s", factor, 0.0, source=columns[index].name, said=_factor(unit, "s")), said


def find_channels(columns: tuple[Column, ...], time: int | None, sheet: Sheet, file: str) -> list[Channel]:
    """Channels of a sheet, or of all columns but the time's where it names none. Raises InputError."""
    if not sheet.columns:
        return [_plain(_name(c.name), i, c) for i, c in enumerate(columns) if i != time]
    return [_channel(name, entry, columns, file) for name, entry in sheet.columns.items()]


def _channel(name: str, entry: SheetEntry, columns: tuple[Column, ...], file: str) -> Channel:
    index = _place(columns, entry.column if entry.column is not None else name, name, file)
    column = columns[index]
    written = column.unit
    if entry.unit is not None and written and not _same(entry.unit, written):
        raise InputError(
            f"is in {written} by the file and in {entry.unit} by the sheet. Leave the unit out of the sheet, or "
            "correct it there.",
            file=file,
            field=name,
        )
    unit = entry.unit if entry.unit is not None else written
    if entry.unit is None and not entry.zero and entry.gain is None and entry.range is None:
        plain = _plain(name, index, column)
        return Channel(**{**vars(plain), "slope": entry.sign * plain.slope, "about": entry.about})
    try:
        factor, si = unit_to_si(unit)
        gain, result = 1.0, si
        if entry.gain is not None:
            gain, text = entry.gain
            result = unit_to_si(f"({text}) * ({unit})" if text and unit else text or unit)[1]
    except ValueError as error:
        raise InputError(f'"{shorten(unit)}" {error}.', file=file, field=name) from None
    low, high = entry.range or (-np.inf, np.inf)
    slope = entry.sign * gain
    said = [_factor(unit, si)] if factor != 1 else []
    said += [f"minus {entry.zero:g} {si}"] if entry.zero else []
    said += [f"times {slope:g}"] if slope != 1 else []
    return Channel(
        name,
        index,
        result,
        slope * factor,
        -slope * entry.zero,
        low / factor,
        high / factor,
        entry.about,
        column.name,
        ", ".join(said),
    )


def _plain(name: str, index: int, column: Column) -> Channel:
    """Channel of a column as it is, in SI where its unit is known."""
    try:
        factor, si = unit_to_si(column.unit)
    except ValueError:
        said = f"the unit {column.unit} is not known here: left as it is"
        return Channel(name, index, column.unit, 1.0, 0.0, source=column.name, said=said)
    said = _factor(column.unit, si) if factor != 1 else ""
    return Channel(name, index, si, factor, 0.0, source=column.name, said=said)


def _factor(unit: str, si: str) -> str:
    return f"{unit} to {si or '1'}" if unit != si else ""


def _same(a: str, b: str) -> bool:
    try:
        return unit_to_si(a) == unit_to_si(b)
    except ValueError:
        return False


def _place(columns: tuple[Column, ...], wanted: int | str | None, field: str, file: str) -> int:
    names = [column.name for column in columns]
    if isinstance(wanted, int):
        if wanted > len(columns):
            raise InputError(f"column {wanted} is not there: the file has {len(columns)}.", file=file, field=field)
        return wanted - 1
    if wanted not in names:
        raise InputError(
            f'there is no column called "{shorten(wanted)}".{did_you_mean(str(wanted), names)}', file=file, field=field
        )
    return names.index(wanted)


def _name(text: str) -> str:
    """Name of a quantity: as in the file, without what netCDF does not let stand."""
    return text.strip().replace("/", " per ") or "unnamed"

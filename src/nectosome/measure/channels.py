"""From columns of a file to quantities: the column of each, its name, and the conversion of its readings to SI."""

import re
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, did_you_mean, scale_to_si, shorten, unit_to_si

from .clock import Clock
from .formats.headings import (
    is_known_unit,
    is_time,
    nanoseconds_beside,
    split_unit,
    time_unit,
    unit_in_name,
    unit_of,
    unknown_bracket,
)
from .formats.source import Column, TableSource
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
    error: float | None = None  # standard error of the quantity [SI]
    about: str = ""
    source: str = ""  # name in the file
    conversion: str = ""  # in words
    doubt: str = ""  # about its unit, in words
    reading: str = ""  # unit of the cells
    wrap: float | None = None  # period after which the cells start again, by the sheet; 0: never
    counted: tuple[float, float] | None = None  # period at which cells go on, and what is added to all of them

    def convert(self, cells: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Quantity [SI] of cells in the file's unit."""
        return self.slope * cells + self.shift if (self.slope, self.shift) != (1.0, 0.0) else cells


def find_time(source: TableSource, time: Time | None, file: str, label: str = "time") -> Clock | None:
    """Clock of the time column, or of another device, of which `label` tells in the sheet; None if there is none.

    Without a sheet it is the first column whose name means time, else one that counts frames of a known rate, else
    whole seconds and the nanoseconds beside them, else one of dates or times of day.
    """
    columns = source.columns
    if time is not None and (time.absent or time.rate is not None):
        return None
    names = [column.name for column in columns]
    partners = {i: nanoseconds_beside(name, names) for i, name in enumerate(names)}
    interval, others = None, list[str]()
    if time is not None:
        index = column_index(source, time.column, label, file)
    else:
        named = [i for i, column in enumerate(columns) if is_time(column.name)]
        frames = [i for i, name in enumerate(names) if name.lower().strip(" #") == "frame"] if source.rate else []
        stamps = [i for i, partner in partners.items() if partner]
        clocks = [i for i, column in enumerate(columns) if column.start or column.daily]
        candidates = named or frames or stamps or clocks
        if not candidates:
            return None
        index = candidates[0]
        others = [f"column {columns[i].place}, {shorten(names[i])}" for i in candidates[1:]] if named else []
        interval = 1 / source.rate if source.rate and candidates is frames else None
    column = columns[index]
    unit = (time.unit if time is not None else None) or column.unit or time_unit(column.heading or column.name) or ""
    partner = partners[index]
    clock = Clock(column, index, "s" if partner else unit, file, time or Time(), label, interval=interval)
    if time is not None and time.host is not None:
        went_on = columns[beside := column_index(source, time.host, f"{label}.host", file)]
        its_unit = went_on.unit or time_unit(went_on.heading or went_on.name) or ""
        clock.host = Clock(went_on, beside, its_unit, file, Time(), f"{label}.host")
    if others:
        taken = f"column {column.place}, {shorten(column.name)}"
        clock.assumed_column = f"{label}: {taken}, by its name, and not {_listed(others)}"
    clock.nanoseconds = names.index(partner) if partner else None
    return clock


def without_time(source: TableSource, time: Time | None) -> tuple[list[str], list[str]]:
    """What is noted, and what is warned of, where no column is the time."""
    if time is not None:
        return [f"time from the sampling rate of {time.rate:g} Hz"] if time.rate is not None else [], []
    if source.rate:
        return [f"time from the file's rate of {source.rate:g} Hz"], []
    texts = [f"column {place}, {shorten(name)}" for place, (name, _) in source.left_out.items() if is_time(name)]
    warnings = [f"{texts[0]}, is text that is no known clock: there is no time"] if texts else []
    return ["no column is called time: name it in a sheet"], warnings


def find_channels(source: TableSource, clock: Clock | None, sheet: Sheet, file: str) -> list[Channel]:
    """Channels of a sheet; without columns in it, of all columns but the time. Raises InputError."""
    columns = source.columns
    if sheet.columns:
        return [_channel(name, entry, source, file) for name, entry in sheet.columns.items()]
    used = {clock.index, clock.nanoseconds} if clock is not None else set[int | None]()
    return [_unchanged(name_of(column), i, column) for i, column in enumerate(columns) if i not in used]


def name_of(column: Column) -> str:
    """Return a column's name without slashes, which netCDF forbids: a topic's as `imu.accel.x`, else as `N per V`."""
    name = column.name.strip()
    name = name.strip("/").replace("/", ".") if name.startswith("/") else re.sub(r"\s*/\s*", " per ", name)
    return name or "unnamed"


def _channel(name: str, entry: SheetEntry, source: TableSource, file: str) -> Channel:
    index = column_index(source, entry.column if entry.column is not None else name, name, file)
    column = source.columns[index]
    plain = all(given is None for given in (entry.zero, entry.gain, entry.range, entry.error))
    if plain and entry.unit is None:
        unchanged = _unchanged(name, index, column)
        slope, shift = entry.sign * unchanged.slope, entry.sign * unchanged.shift
        wrap = _period(entry, unchanged.reading, name, file)
        return replace(unchanged, slope=slope, shift=shift, about=entry.about, wrap=wrap)
    unit, doubt = entry.unit, ""
    if unit is None:
        unit = unit_of(column).unit
        _check_unit(entry, column, unit, name, file)
    elif is_known_unit(column.unit) and not _same(unit, unit_of(column).unit):
        doubt = f"is in {shorten(column.unit)} in the file and in {unit} in the sheet, which holds"
    factor, offset, si = scale_to_si(unit)

    def reading(given: tuple[float, str | None]) -> float:
        """A value of the sheet as a reading in SI."""
        number, known = given
        if known not in (None, si):
            raise InputError(f"{number:g} {known} has not the dimension of the reading, {unit}.", file=file, field=name)
        return number if known is not None else factor * number + offset

    gain, result = 1.0, si
    if entry.gain is not None:
        gain, text = entry.gain
        per = si if offset else unit
        try:
            result = unit_to_si(f"({text}) * ({per})" if text and per else text or per)[1]
        except ValueError as error:
            raise InputError(f'"{shorten(text)}" {error}.', file=file, field=name) from None
    zero = reading(entry.zero) if entry.zero is not None else 0.0
    low, high = ((reading(end) - offset) / factor for end in entry.range) if entry.range else (-np.inf, np.inf)
    slope = entry.sign * gain
    steps = [_factor(unit, si)] if (factor, offset) != (1, 0) else []
    steps += [f"minus {zero:g} {si}"] if zero else []
    steps += [f"times {slope:g}"] if slope != 1 else []
    shift = slope * (offset - zero)
    error = None
    if entry.error is not None:
        number, known = entry.error
        error = abs(slope) * (number if known is not None else factor * number)
    words, wrap = ", ".join(steps), _period(entry, unit, name, file)
    slope *= factor
    return Channel(
        name, index, result, slope, shift, low, high, error, entry.about, column.name, words, doubt, unit, wrap
    )


def _period(entry: SheetEntry, unit: str, name: str, file: str) -> float | None:
    """Return the period of `wrap` in the unit of the cells."""
    if entry.wrap is None:
        return None
    number, known = entry.wrap
    factor, _, si = scale_to_si(unit) if is_known_unit(unit) else (1.0, 0.0, unit)
    if known not in (None, si):
        raise InputError(f"{number:g} {known} has not the dimension of the reading.", file=file, field=f"{name}.wrap")
    return number if known is None else number / factor


def _check_unit(entry: SheetEntry, column: Column, unit: str, name: str, file: str) -> None:
    """Refuse a zero, a gain or a range of a reading where neither file nor sheet says its unit, or the file another."""
    given = [x[1] for x in (entry.zero, entry.error, *(entry.range or ())) if x is not None]
    gain = entry.gain[1] if entry.gain is not None else ""
    if not any((*given, gain)):
        return
    per = gain.rpartition("/")[2].strip("( )") if "/" in gain else ""
    if not is_known_unit(unit):
        why = f'the file\'s "{shorten(column.unit)}" is not a known one' if column.unit else "the file says none"
    elif is_known_unit(per) and unit_to_si(per)[1] != scale_to_si(unit)[2]:
        why = f"the gain is per {per}, and the file says {unit}"
    else:
        return
    raise InputError(
        f"needs the unit of the reading beside it, as in unit: V or unit: counts; {why}.", file=file, field=name
    )


def _unchanged(name: str, index: int, column: Column) -> Channel:
    """Channel of a column without a sheet, in SI if its unit is known."""
    meant = unit_of(column)
    unit, doubt = meant.unit, meant.doubt
    try:
        factor, shift, si = scale_to_si(unit)
        conversion = _factor(column.unit, si) if (factor, shift) != (1, 0) else ""
    except ValueError:
        factor, shift, si, conversion = 1.0, 0.0, unit, f"unknown unit {shorten(unit)}: not converted"
        doubt = doubt or f'"{shorten(unit)}" is not a known unit: not converted. Write unit: in a sheet, as in unit: V'
    conversion += f" ({meant.remark})" if meant.remark else ""
    return Channel(name, index, si, factor, shift, source=column.name, conversion=conversion, doubt=doubt, reading=unit)


def unit_doubts(channels: list[Channel], sheet: Sheet) -> tuple[list[str], list[str]]:
    """What is noted, and what is warned of, about units that were not taken from names."""
    said = {name for name, entry in sheet.columns.items() if entry.unit is not None or entry.gain is not None}
    bare = [c for c in channels if not c.unit and not c.conversion and not c.doubt and c.name not in said]
    ends = {c.source: unit for c in bare if (unit := unit_in_name(c.source))}
    brackets = [bracket for c in bare if (bracket := unknown_bracket(c.source))]
    notes = (
        [f"no known unit, part of the name: {_listed(f'({b})' for b in dict.fromkeys(brackets))}"] if brackets else []
    )
    warnings = [f"{c.name}: {c.doubt}" for c in channels if c.doubt]
    if ends:
        name, unit = next(iter(ends.items()))
        listed = _listed(f"{source} ({end})" for source, end in ends.items())
        how = f'write columns: {{"{name}": {{unit: {unit}}}}} in a sheet'
        warnings.append(f"names that may hold a unit, which is not taken: {listed}. If it is one, {how}")
    return notes, warnings


def _listed(words: Iterable[str]) -> str:
    listed = [shorten(word) for word in words]
    return ", ".join(listed[:8]) + (f" and {len(listed) - 8} more" if len(listed) > 8 else "")


def _factor(unit: str, si: str) -> str:
    return f"{unit} to {si or '1'}" if unit != si else ""


def _same(a: str, b: str) -> bool:
    return is_known_unit(a) and is_known_unit(b) and scale_to_si(a) == scale_to_si(b)


def column_index(source: TableSource, chosen: int | str | None, field: str, file: str) -> int:
    """Return the index of the column with this place in the file, or with this name, with or without its unit."""
    columns = source.columns
    if isinstance(chosen, int):
        matches = [i for i, column in enumerate(columns) if column.place == chosen]
        if not matches:
            if chosen in source.left_out:
                name, what = source.left_out[chosen]
                raise InputError(f"column {chosen}, {shorten(name)}, is {what}, not numbers.", file=file, field=field)
            last = max([column.place for column in columns] + list(source.left_out))
            raise InputError(f"there is no column {chosen}: the file has {last}.", file=file, field=field)
        return matches[0]
    names = [column.name for column in columns]
    headings = [column.heading for column in columns]
    for known in (names, headings):
        if chosen in known:
            return known.index(chosen)
    texts = [name for name, _ in source.left_out.values()]
    if chosen in texts:
        raise InputError(f'the column "{shorten(chosen)}" is not of numbers.', file=file, field=field)
    raise InputError(
        f'there is no column called "{shorten(chosen)}".{did_you_mean(str(chosen), [*names, *texts])}',
        file=file,
        field=field,
    )


def named_channels(
    channels: Sequence[Channel], conditions: Iterable[str], taken: str, file: str
) -> tuple[list[Channel], list[str]]:
    """Return quantities with names that are free, and notes on those that got another; `taken` is the coordinate.

    Raises InputError for a condition that has the name of a quantity.
    """
    names = {channel.name for channel in channels}
    for name in conditions:
        if name in names:
            raise InputError("is a column of the file, too. Give the condition another name.", file=file, field=name)
    given, notes = list(channels), list[str]()
    for k, channel in enumerate(channels):
        if channel.name == taken:
            name = next(free for n in range(2, len(names) + 3) if (free := f"{taken} ({n})") not in names)
            given[k] = replace(channel, name=name)
            notes.append(f"the column {taken} is a quantity, named {name}, as {taken} is the coordinate")
    return given, notes


def doubtful_names(
    source: TableSource, chosen: Mapping[str, int | str | None], channels: Sequence[Channel], time: Mapping[int, str]
) -> list[str]:
    """Return warnings of columns that a sheet may have mixed up.

    `chosen` is what it says of the column of each quantity, and `time` the fields with the clocks, by their column.
    """
    notes = list[str]()
    of_column: dict[int, list[str]] = defaultdict(list)
    by_name: dict[str, list[int]] = defaultdict(list)
    for k, column in enumerate(source.columns):
        by_name[split_unit(column.heading).name if column.heading else column.name].append(k)
    for channel in channels:
        if channel.name not in chosen:
            continue
        of_column[channel.index].append(channel.name)
        if channel.index in time:
            notes.append(f"{channel.name}: is the column of the {time[channel.index]}, {shorten(channel.source)}")
        same = by_name.get(channel.name, [])
        if same and channel.index not in same:
            why = f"is the column {shorten(channel.source)}; the file's own column {channel.name} is another"
            notes.append(f"{channel.name}: {why}")
        named = chosen[channel.name] or channel.name
        twins = by_name.get(str(named), [])
        if isinstance(named, str) and len(twins) > 1:
            places = " and ".join(str(source.columns[k].place) for k in twins[:8])
            first = source.columns[channel.index].place
            notes.append(f"{channel.name}: columns {places} are called {shorten(named)}; it is column {first}")
    for index, names in of_column.items():
        if len(names) > 1:
            notes.append(f"{', '.join(names[:8])}: are one column, {shorten(source.columns[index].name)}")
    return notes

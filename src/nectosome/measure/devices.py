"""Devices that share a file with others and have a clock of their own: their readings at the times of the recording."""

import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError, count, did_you_mean, scale_to_si

from .channels import Channel, column_index, find_time, name_of
from .clock import Clock
from .formats.clock_text import date_time
from .formats.file_errors import check_memory, damage_as_input_error
from .formats.headings import is_time
from .formats.source import Column, Piece, TableSource
from .sheet import DeviceClock, Sheet, SheetEntry, Time
from .timed_channels import TimedChannels

_COMPARED = 1000  # rows by which two columns of times are compared
_WORD = r"(?:t|[Tt]ime|[Ss]tamp|[Tt]ime_?stamp|[Cc]lock)"
_NUMBERED, _BEFORE = re.compile(rf"{_WORD}[ _.]?\d+"), re.compile(rf"{_WORD}[ _.]+(?P<of>.+)")
_BEHIND = re.compile(rf"(?P<of>.+)[ _.]+{_WORD}")
_MOSTLY = 0.9  # share of its rows in which a clock goes on that may stand still or be set back
_SLOWER = 1.5  # ratio of the intervals from which readings between samples are warned of


def with_tables_side_by_side(source: TableSource, sheet: Sheet, file: str) -> Sheet:
    """A sheet in which each column has its own column of times, where a file has several tables side by side.

    It is the one that is named after the column, else the one on its left, or on its right where each stands behind
    its quantity. One that says the same times as the first, whatever their unit and zero, to half an interval, is no
    other clock; the zeros count where both are called alike or after quantities. A sheet that names clocks with times
    of their own, a rate or no time is left as it is. Where the file itself says the times of each column, these are
    taken, and the recording has those of the longest table that the sheet names.
    """
    if source.times:
        return _with_times_of_file(source, sheet, file)
    columns, first = source.columns, find_time(source, sheet.time, file)
    if any(not clock.absent for clock in sheet.clocks.values()) or (first is None and sheet.time is not None):
        return sheet
    times, piece = _times(source)
    if first is None and len(times) > 1:
        first = find_time(source, Time(column=_named(columns[min(times)])), file)
    if piece is None or first is None or len(times) < 2:
        return sheet
    owners = _owners(columns, times, first.index)
    if sheet.time is None and not is_time(first.column.name) and not times.keys() <= {*owners.values()}:
        return sheet  # t_start and t_end are quantities
    own = {i: DeviceClock(column=_named(columns[i])) for i in times if i in owners.values() and i != first.index}
    own = {i: time for i, time in own.items() if not _same_times(first, i, time, piece, source, file, times[i])}
    if not own and (sheet.time is not None or find_time(source, None, file) is not None):
        return sheet
    return _on_own_clocks(source, sheet, file, first, owners, own)


def _with_times_of_file(source: TableSource, sheet: Sheet, file: str) -> Sheet:
    """A sheet in which each column has the times that its file says.

    Raises InputError for a rate, or no time, of several tables.
    """
    used = [_index(source, name, entry, file) for name, entry in sheet.columns.items()] or list(source.times)
    tables = sorted({source.times.get(index, index) for index in used})
    time = sheet.time or Time(column=_named(source.columns[tables[0]]))
    first = find_time(source, time, file)
    if first is None:
        if len(tables) > 1:
            why = (
                "has topics with times of their own. Leave time out, or choose one, as in file: {table: /cell/wrench}."
            )
            raise InputError(why, file=file, field="time")
        return sheet
    mine = source.times.get(first.index, first.index)
    own = {i: DeviceClock(column=_named(source.columns[i])) for i in tables if i != mine}
    return _on_own_clocks(source, sheet.model_copy(update={"time": time}), file, first, source.times, own)


def _index(source: TableSource, name: str, entry: SheetEntry, file: str) -> int:
    """Index of the column of a quantity."""
    return column_index(source, entry.column if entry.column is not None else name, name, file)


def _on_own_clocks(
    source: TableSource,
    sheet: Sheet,
    file: str,
    first: Clock,
    owners: Mapping[int, int],
    own: Mapping[int, DeviceClock],
) -> Sheet:
    """A sheet in which columns have their `own` clocks, by the columns of their times, which are their `owners`.

    Raises InputError for a clock of a sheet that stands beside columns of several times.
    """
    columns, entries = source.columns, sheet.columns
    if own and not entries:
        left = [c for i, c in enumerate(columns) if i not in (first.index, *own)]
        entries = {name_of(c): SheetEntry(column=_named(c)) for c in left}

    clocks, starts = dict(sheet.clocks), dict[str, int]()

    def on_clock(name: str, entry: SheetEntry) -> SheetEntry:
        start = owners.get(_index(source, name, entry, file))
        said = None if entry.clock is None else sheet.clocks.get(entry.clock)
        if start is None or start not in own or (said is not None and not said.absent):
            return entry
        clock = entry.clock or columns[start].name
        if starts.setdefault(clock, start) != start:
            both = f"{columns[starts[clock]].name} and {columns[start].name}"
            why = f"has columns with the times {both}. Write a clock for each"
            raise InputError(f"{why}.", file=file, field=f"clocks.{clock}")
        clocks[clock] = clocks.get(clock, own[start]).model_copy(update={"column": own[start].column})
        return entry.model_copy(update={"clock": clock})

    entries = {name: on_clock(name, entry) for name, entry in entries.items()}
    time = sheet.time or Time(column=_named(columns[first.index]))
    return sheet.model_copy(update={"time": time, "clocks": clocks, "columns": entries})


def _named(column: Column) -> int | str:
    """A column as a sheet names it."""
    return column.place or column.name


def _owners(columns: Sequence[Column], times: dict[int, str], first: int) -> dict[int, int]:
    """The column of times of each quantity, by their indices; the recording's, `first`, has those that are left out."""
    quantities = [i for i in range(len(columns)) if i not in times]
    named = {of.casefold(): i for i, of in times.items() if of}
    owners = {}
    for j in quantities:
        name = columns[j].name.casefold()
        of = max((of for of in named if re.match(rf"{re.escape(of)}(?![^\W_])", name)), key=len, default=None)
        if of is not None:
            owners[j] = named[of]
    turns = [i in times for i in range(len(columns))]
    if len(turns) > 2 and turns == [False, True] * (len(turns) // 2):  # each time stands behind its quantity
        return {j: j + 1 for j in quantities} | owners
    starts = [i for i in times if i + 1 not in times and i + 1 < len(columns) and i - 1 not in times]
    if starts and starts[0] == first:
        owners = {j: max(i for i in starts if i < j) for j in quantities if j > first} | owners
    return owners


def _times(source: TableSource) -> tuple[dict[int, str], Piece | None]:
    """What each column of times is the time of, as `force` of `t_force` ("" where its name does not say), and rows.

    It is one by its name, or by a part of that where its numbers go on: all of them, or with a unit of time most. Rows
    are read where there are two such names.
    """
    parts = ((i, of) for i, column in enumerate(source.columns) if (of := _time_of(column)) is not None)
    named = dict(parts)
    piece = next(source.pieces(_COMPARED), None) if len(named) > 1 else None
    if piece is None:
        return {}, None
    return {i: of for i, of in named.items() if is_time(source.columns[i].name) or _goes_on(source, i, piece)}, piece


def _time_of(column: Column) -> str | None:
    """What the times of a column are those of, by its name; "" where that does not say, None of a quantity."""
    if is_time(column.name) or _NUMBERED.fullmatch(column.name):
        return ""
    match = _BEFORE.fullmatch(column.name) or _BEHIND.fullmatch(column.name)
    return match["of"] if match is not None else None


def _goes_on(source: TableSource, index: int, piece: Piece) -> bool:
    """Whether the numbers of a column increase: all of them, or with a unit of time most."""
    try:
        unit = scale_to_si(source.columns[index].unit)[2]
    except ValueError:
        return False
    cells = piece.values[:, index]
    on = np.diff(cells[np.isfinite(cells)]) > 0
    return unit in ("", "s") and bool(on.any() and (on.all() or (unit == "s" and np.mean(on) > _MOSTLY)))


def other_times(source: TableSource, sheet: Sheet, file: str) -> list[str]:
    """Warnings of columns that say other times than the time, and that no clock has; none where the file knows."""
    first = find_time(source, sheet.time, file)
    if source.times or first is None or any(not clock.absent for clock in sheet.clocks.values()):
        return []
    times, piece = _times(source)
    notes = list[str]()
    for i in times:
        column = source.columns[i]
        time = Time(column=_named(column))
        if piece is not None and i != first.index and not _same_times(first, i, time, piece, source, file, times[i]):
            how = f"write clocks: {{other: {{column: {time.column}}}}} in a sheet, and clock: other beside them"
            notes.append(f"{column.name}: other times than {first.column.name}. If columns have these, {how}")
    return notes


def _same_times(first: Clock, index: int, time: Time, piece: Piece, source: TableSource, file: str, of: str) -> bool:
    """Whether two columns say the same times, from the first row on that has both.

    Their zeros count where both are alike: by their headings, or as times `of` quantities.
    """
    clocks = find_time(source, time, file, f"clocks.{source.columns[index].name}"), replace(first)
    seconds, kinds = [], []
    for clock in clocks:
        assert clock is not None  # a column is named
        clock.begin(piece.values)
        seconds.append(clock.seconds(*piece))
        kinds.append((clock.kind, clock.unit))
    there = [np.isfinite(x) for x in seconds]
    if not (there[0] == there[1]).all() or there[0].sum() < 2:
        return False
    ours, theirs = (x[there[0]] for x in seconds)
    alike = bool(of) or source.columns[index].name.startswith(f"{first.column.name} (")
    zero = 0.0 if alike and kinds[0] == kinds[1] else ours[0] - theirs[0]
    return bool(np.abs(ours - theirs - zero).max() <= 0.5 * np.median(np.abs(np.diff(theirs))))


def with_one_row_a_time(pieces: Iterable[Piece], time: int, joined: list[int]) -> Iterator[Piece]:
    """Pieces in which rows of several devices at one time are one row; those rows that are left out go to `joined`.

    They are consecutive, and of each column one has a reading at most. `time` is the index of the column.
    """
    kept: Piece | None = None
    for piece in pieces:
        if kept is not None and piece.rows.size and piece.values[0, time] == kept.values[-1, time]:
            begun = int(np.flatnonzero(_is_first(kept, time))[-1])  # of these rows the next piece has more
            held, kept = Piece(kept.rows[begun:], kept.values[begun:]), Piece(kept.rows[:begun], kept.values[:begun])
            piece = Piece(*(np.concatenate(x) for x in zip(held, piece, strict=True)))
        if kept is not None and kept.rows.size:
            yield _joined(kept, time, joined)
        kept = piece if piece.rows.size else kept
    if kept is not None:
        yield _joined(kept, time, joined)


def _is_first(piece: Piece, time: int) -> Bool[np.ndarray, "n"]:
    return np.concatenate([[True], piece.values[1:, time] != piece.values[:-1, time]])


def _joined(piece: Piece, time: int, joined: list[int]) -> Piece:
    """One row for each that is the first of its time, with all readings of that; as it was where a column has two."""
    first = _is_first(piece, time)
    if first.all():
        return piece
    starts, is_time = np.flatnonzero(first), np.arange(piece.values.shape[1]) == time
    known = ~np.isnan(piece.values)
    if (np.add.reduceat(known & ~is_time, starts, dtype=int) > 1).any():
        return piece
    joined += piece.rows[~first].tolist()
    values = np.add.reduceat(np.where(known & (~is_time | first[:, None]), piece.values, 0.0), starts)
    return Piece(piece.rows[first], np.where(np.logical_or.reduceat(known, starts), values, np.nan))


def devices_of(
    source: TableSource, sheet: Sheet, channels: Sequence[Channel], file: str, memory: int
) -> "list[Device]":
    """The devices of a sheet's `clocks`. Raises InputError for a clock without columns, and one that is not there."""
    named = {name: entry.clock for name, entry in sheet.columns.items() if entry.clock is not None}
    for name, clock in named.items():
        if clock not in sheet.clocks:
            why = (
                f'there is no clock "{clock}".{did_you_mean(clock, sheet.clocks)} Write it under clocks, as in clocks:'
            )
            how = f"{why} {{{clock}: {{column: stamp}}}}."
            raise InputError(how, file=file, field=f"columns.{name}.clock")
    unused = next((clock for clock in sheet.clocks if clock not in named.values()), None)
    if unused is not None:
        why = f"no column has this clock. Write clock: {unused} beside each column of that device."
        raise InputError(why, file=file, field=f"clocks.{unused}")
    own = [name for name, clock in sheet.clocks.items() if not (clock.absent and clock.is_right)]
    return [Device(source, sheet, x, [c for c in channels if named.get(c.name) == x], file, memory) for x in own]


def told_clocks(sheet: Sheet) -> dict[str, dict[str, Any]]:
    """What a recording says of the clocks of a sheet: their columns, and what a fit shall find of them."""
    return {
        name: {
            "columns": [column for column, entry in sheet.columns.items() if entry.clock == name],
            **({} if clock.is_known else {"shift": clock.shift, "drift": clock.drift}),
        }
        for name, clock in sheet.clocks.items()
    }


class Device:
    """Columns with a clock of their own; all of their samples are kept until they are resampled."""

    def __init__(self, source: TableSource, sheet: Sheet, name: str, channels: list[Channel], file: str, memory: int):
        self.label, self._file, self._memory = f"clocks.{name}", file, memory
        self._settings = sheet.clocks[name]
        timed = sheet.time if self._settings.absent else self._settings
        is_shared = self._settings.absent
        self.columns = TimedChannels(source, timed, channels, file, self.label, has_gaps=True, is_shared=is_shared)
        self._pieces: list[list[np.ndarray]] = []
        self.bytes = 0
        self.notes: list[str] = []  # how it was resampled
        self.warnings: list[str] = []

    def begin(self, values: Float[np.ndarray, "n k"], recording: Clock | None) -> None:
        """Settle unit and zero by the first rows. Raises InputError where the zeros of both clocks are unrelated."""
        clock = self.columns.clock
        if clock is not None:
            clock.begin(values)
        if clock is not None and recording is not None and clock.start and recording.start:
            since = date_time(recording.start)
            if self._settings.since is not None and date_time(self._settings.since) != since:
                why = f"since is not that of the time, which counts from {recording.start}. Leave it out here"
                raise InputError(f"{why}, or write it under time.", file=self._file, field=self.label)
            clock.count_from(since)
        ours, theirs = (x.kind if x is not None else "the first row" for x in (clock, recording))
        if ours != theirs and "offset" not in self._settings.model_fields_set:
            why = f"this clock counts from {ours}, and the time from {theirs}"
            raise InputError(f"{why}. Write what to add to it, as in offset: 0 s.", file=self._file, field=self.label)

    def add(self, rows: Int[np.ndarray, "n"], values: Float[np.ndarray, "n k"]) -> None:
        """Take consecutive rows of the file."""
        time, quantities = self.columns.piece(rows, values)
        self._pieces.append([time, *quantities])
        self.bytes += time.nbytes * (1 + len(quantities))
        with damage_as_input_error(Path(self._file)):
            check_memory([3 * self.bytes], self._memory, "resampling takes")  # as read, resampled, and between

    def variables(self, times: Float[np.ndarray, "m"]) -> dict[str, tuple[str, np.ndarray, dict[str, Any]]]:
        """Its quantities at the times of the recording [s], as `signals.resample` finds them.

        Between samples they are linear, of a clock with the times of the recording cubic, NaN in gaps and beyond the
        ends; what the recording samples more slowly is low-passed before. Raises InputError for fewer than two samples
        on either side.
        """
        import xarray as xr

        from .signals.resample import resample

        time, *quantities = (np.concatenate(rows) for rows in zip(*self._pieces, strict=True))
        time = self._settings.times(time, float(times[0])) if times.size else time
        names = [channel.name for channel in self.columns.channels]
        if min(time.size, times.size) < 2:
            why = f"{count(time.size, 'sample')} of it and {count(times.size, 'time')} of the recording"
            raise InputError(f"{why}: at least two are needed of each.", file=self._file, field=self.label)
        own = xr.Dataset({name: ("time", x) for name, x in zip(names, quantities, strict=True)}, {"time": time})
        listed = ", ".join(names)
        try:
            resampled = resample(own, times=times, method="cubic" if self._settings.absent else "linear")
        except ValueError:  # shorter than the filter
            resampled = resample(own, times=times, antialias=False)
            self.warnings.append(f"{listed}: too short for a low-pass: what is faster than the recording may alias")
        ours, theirs = (float(np.median(np.diff(x))) for x in (time, times))
        cutoff = json.loads(resampled.attrs["processing"])[-1]["antialias"]
        low = f", after a low-pass of {cutoff:.4g} Hz" if cutoff else ""
        every = f"{time.size} samples, every {ours:.4g} s"
        self.notes.append(f"{listed}: by {self.label} ({every}), resampled at the times of the recording{low}")
        if ours > _SLOWER * theirs:
            why = f"sampled every {ours:.4g} s, and the recording every {theirs:.4g} s"
            self.warnings.append(f"{listed}: {why}: most values are interpolated, and no measurements")
        made = {}
        for name, told in zip(names, self.columns.attributes(), strict=True):
            values = resampled[name].values
            missing = int(np.isnan(values).sum())
            if missing:
                self.warnings.append(f"{name}: {count(missing, 'time')} of the recording without a reading")
            made[name] = ("time", values, told | {"missing": missing, "clock": self.label})
        return made

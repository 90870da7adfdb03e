"""LabVIEW's TDMS files: the channels of one group as columns, with a time column from their clocks."""

import logging
import math
from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.measure.formats.arrays import ArraySource
from nectosome.measure.formats.cf_attributes import text
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.named_arrays import NamedArray, SkippedEntry
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import choose
from nectosome.measure.formats.tdms_channels import Bytes, channel_of, whole_rows
from nectosome.units import InputError

if TYPE_CHECKING:
    from nptdms import TdmsFile
    from nptdms.tdms_segment import TdmsSegment

_Properties = Mapping[str, Any]


class Ramp:
    """Equally spaced numbers."""

    def __init__(self, start: float, step: float, rows: int):
        self.shape, self.dtype, self._start, self._step = (rows,), np.dtype(float), start, step

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._start + self._step * np.arange(*rows.indices(self.shape[0]))


@dataclass(frozen=True)
class _Clock:
    """Sampling instants (or positions) of a channel; equal for channels of one table."""

    start: float
    step: float
    rows: int
    name: str
    unit: str

    def __str__(self) -> str:
        return f"every {self.step:g} {self.unit}{f' from {self.start:g}' if self.start else ''}"

    def item(self, group: str) -> NamedArray:
        """Return it as a column."""
        note = f"{self.name}: from wf_increment = {self.step:g} and wf_start_offset = {self.start:g}"
        ramp = Ramp(self.start, self.step, self.rows)
        return NamedArray(self.name, ramp, self.unit, group=group, along=str(self), first=True, notes=[note])


def with_clock(items: Sequence[NamedArray], properties: Mapping[str, _Properties]) -> list[NamedArray]:
    """Return the channels of a group, after their times if no channel is the time.

    `properties` are those of the channels, by name. Channels with different clocks have different `along`.
    """
    times = {item.array.shape for item in items if item.first}
    if any(item.array.shape in times for item in items if not item.first):
        return list(items)
    zero = next((p["wf_start_time"] for p in properties.values() if "wf_start_time" in p), None)
    clocks = {item.name: _clock(item.array.shape[0], properties[item.name], zero) for item in items}
    known = list(dict.fromkeys(clock for clock in clocks.values() if clock is not None))
    by_rows = {rows: [clock for clock in known if clock.rows == rows] for rows in {clock.rows for clock in known}}
    timed = []
    for item in items:
        clock = clocks[item.name]
        if clock is None and len(by_rows.get(item.array.shape[0], [])) == 1:  # computed from the others
            clock = by_rows[item.array.shape[0]][0]
        timed.append(item if clock is None else replace(item, along=str(clock)))
    return [*(clock.item(items[0].group) for clock in known), *timed]


def _clock(rows: int, properties: _Properties, zero: np.datetime64 | None) -> _Clock | None:
    step, start = (_number(properties.get(key, 0)) for key in ("wf_increment", "wf_start_offset"))
    if not (math.isfinite(step) and step > 0 and math.isfinite(start)):
        return None
    later = _seconds(properties.get("wf_start_time", zero), zero)
    if abs(later) > step / 2:  # less is jitter of the start
        start += later
    name, unit = (text(properties.get(key, "")) for key in ("wf_xname", "wf_xunit_string"))
    other = name and not is_time(name)
    return _Clock(start, step, rows, name if other else "time", unit if other else unit or "s")


def _number(value: Any) -> float:
    return float(value) if isinstance(value, int | float | np.number) else math.nan


def _seconds(time: Any, zero: Any) -> float:
    both = isinstance(time, np.datetime64) and isinstance(zero, np.datetime64)
    return float((time - zero) / np.timedelta64(1, "s")) if both else 0.0


def open_tdms(path: Path, options: Options) -> TableSource:
    """Open a .tdms file; of an unfinished one, the whole rows are kept and `repairs` says so.

    Raises InputError for another format, a damaged file, and channels without a common length and clock.
    """
    from nptdms import TdmsFile
    from nptdms.log import log_manager

    start = first_bytes(path)
    if not start.startswith(b"TDSm"):
        raise wrong_format(path, "a LabVIEW file (.tdms)", start)
    log_manager.set_level(logging.ERROR)  # its warnings are in `repairs`
    with damage_as_input_error(path), ExitStack() as stack:
        stream = stack.enter_context(path.open("rb"))
        file = TdmsFile.open(stream)  # a stream, so that npTDMS does not read a stale .tdms_index
        lost = _lost(file, path.stat().st_size)
        entries = _inventory(file, Bytes(stream))
        if lost and not any(isinstance(entry, NamedArray) for entry in entries):
            raise InputError("holds no whole row of numbers: it is cut off.")
        table = choose(entries, options.table, beside=False)
        repairs = [f"{lost}; {table.rows} whole rows are kept."] if lost else []
        return ArraySource("tdms", path, table.blocks(), table.found, repairs, stack.pop_all().close)


def _inventory(file: "TdmsFile", stream: Bytes) -> list[NamedArray | SkippedEntry]:
    """The channels of all groups, with the time of each group."""
    segments, rows = _segments(file), whole_rows(file)
    entries: list[NamedArray | SkippedEntry] = []
    for group in file.groups():
        channels = {channel.name: channel for channel in group.channels()}
        inside = [channel_of(file, group, c, stream, segments, rows.get(c.path, len(c))) for c in channels.values()]
        properties = {name: channel.properties for name, channel in channels.items()}
        entries += with_clock([entry for entry in inside if isinstance(entry, NamedArray)], properties)
        entries += [entry for entry in inside if isinstance(entry, SkippedEntry)]
    return entries


def _lost(file: "TdmsFile", size: int) -> str:
    """What is missing at the end of a file; "" for a complete one."""
    segments = _segments(file)
    if file.file_status.incomplete_final_segment:
        return "the file ends within a segment, as if LabVIEW had been stopped"
    end = segments[-1].next_segment_pos if segments else 0
    return f"the last {size - end} bytes are the beginning of a segment that was not written" if end < size else ""


def _segments(file: "TdmsFile") -> "list[TdmsSegment]":
    reader: Any = file._reader
    return reader._segments

"""LabVIEW's TDMS files: the channels of one group as columns, with a time column from their clocks.

npTDMS reads the structure of a file and scales its values. The values are read here, by rows: npTDMS would read each
chunk of a file as a whole.
"""

import logging
import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from nectosome.measure.formats.arrays import ArraySource, LazyArray
from nectosome.measure.formats.file_errors import damage_as_input_error, first_bytes, wrong_format
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, choose, classify, text
from nectosome.units import InputError

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile, TdmsGroup
    from nptdms.tdms_segment import TdmsSegment

ENDINGS = ".tdms", ".tdms_index"
BEGINNINGS = (b"TDSm",)

_Properties = Mapping[str, Any]
_STAMP = np.dtype([("fractions", "<u8"), ("seconds", "<i8")])  # seconds since 1904, and fractions of 2^-64 s
_EPOCH = np.datetime64("1904-01-01T00:00:00", "us")
_UNITS = ("unit_string", "unit", "NI_UnitDescription")


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
        entries = _inventory(file, path)
        if lost and not any(isinstance(entry, NamedArray) for entry in entries):
            raise InputError("holds no whole row of numbers: it is cut off.")
        table = choose(entries, options.table, beside=False)
        repairs = [f"{lost}; {table.rows} whole rows are kept."] if lost else []
        return ArraySource(
            "tdms", path, table.blocks(), table.found, repairs, close=stack.pop_all().close, left_out=table.left_out
        )


def _inventory(file: "TdmsFile", path: Path) -> list[NamedArray | SkippedEntry]:
    """The channels of all groups, with the time of each group."""
    rows = _whole_rows(file)
    entries: list[NamedArray | SkippedEntry] = []
    for group in file.groups():
        channels = {channel.name: channel for channel in group.channels()}
        inside = [_column(file, group, c, path, rows.get(c.path, len(c))) for c in channels.values()]
        properties = {name: channel.properties for name, channel in channels.items()}
        timed = _with_clock([entry for entry in inside if isinstance(entry, NamedArray)], properties)
        kept = {entry.name: entry for entry in timed if not entry.computed}
        entries += [entry for entry in timed if entry.computed]
        entries += [entry if isinstance(entry, SkippedEntry) else kept[entry.name] for entry in inside]
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


def _whole_rows(file: "TdmsFile") -> dict[str, int]:
    """The common number of rows of channels that were written together, by path, for an incomplete file."""
    statuses = file.file_status.channel_statuses or {}
    ends: dict[tuple[str, int, int], dict[str, int]] = defaultdict(dict)
    for group in file.groups():
        for channel in group.channels():
            if (status := statuses.get(channel.path)) is not None:
                before = len(channel) - status.read_length
                ends[group.name, before, status.expected_length][channel.path] = len(channel)
    return {path: min(together.values()) for together in ends.values() for path in together}


def _stamps(raw: LazyArray) -> tuple[LazyArray, np.datetime64]:
    """Times in seconds since the first one, and the first one, in UTC."""
    first = raw[0:1]
    seconds, fractions = int(first["seconds"][0]), int(first["fractions"][0])

    def read(rows: slice) -> np.ndarray:
        times = raw[rows]
        return (times["seconds"] - seconds) + (times["fractions"] * 2.0**-64 - float(fractions) * 2.0**-64)

    start = _EPOCH + np.timedelta64(seconds * 10**6 + (fractions * 10**6 >> 64), "us")
    return LazyArray(raw.shape, float, read), start


def _column(
    file: "TdmsFile", group: "TdmsGroup", channel: "TdmsChannel", path: Path, rows: int
) -> NamedArray | SkippedEntry:
    """The first `rows` of a channel as a column, or the reason to skip it."""
    from nptdms import types
    from nptdms.base_segment import RawChannelDataChunk
    from nptdms.scaling import get_scaling

    name, kind = channel.name, channel.data_type
    if kind is types.String:
        return SkippedEntry(name, "text", group.name, rows=len(channel))
    if kind is None or not rows:
        return SkippedEntry(name, "empty", group.name)
    unit = next((u for key in _UNITS if (u := text(channel.properties.get(key, "")))), "")
    runs = _runs(file, channel.path)
    if runs is None:  # decoded by npTDMS
        daqmx = LazyArray((rows,), channel.dtype, lambda piece: np.asarray(channel[piece]))
        return classify(name, daqmx, group.name, unit=unit)
    if sum(run.rows for run in runs) != len(channel):
        raise ValueError("the position of the channel does not agree with its length")
    stamped = kind is types.TimeStamp
    raw = _raw_values(path, runs, _STAMP if stamped else np.dtype(kind.nptype).newbyteorder("<"), rows)
    if stamped:
        times, first = _stamps(raw)
        note = f"{name}: seconds since {first} UTC"
        return classify(name, times, group.name, unit="s", notes=[note], first=True, start=str(first))
    scaling = get_scaling(channel.properties, group.properties, file.properties)
    values = raw
    if scaling is not None and raw.dtype.kind != "c":
        values = LazyArray(raw.shape, float, lambda piece: scaling.scale(RawChannelDataChunk.channel_data(raw[piece])))
    return classify(name, values, group.name, unit=unit, first=is_time(name))


class _Run(NamedTuple):
    """Raw values of a channel in equal chunks.

    The first chunk begins at byte `base`. Each chunk has `stride` bytes; `samples` values of the channel begin at its
    byte `offset`. An interleaved segment is a run of chunks with one value of each channel.
    """

    base: int
    stride: int
    offset: int
    samples: int
    chunks: int
    big: bool  # big-endian

    @property
    def rows(self) -> int:
        return self.samples * self.chunks

    def values(self, raw: np.ndarray, start: int, stop: int, dtype: np.dtype[Any]) -> np.ndarray:
        """Values `start` to `stop` - 1 of this run of the file with the bytes `raw`."""
        if self.big:
            big = [("seconds", ">i8"), ("fractions", ">u8")]
            dtype = np.dtype(big) if dtype.names else dtype.newbyteorder(">")
        skipped, last = start // self.samples, (stop - 1) // self.samples
        shape, at = (last - skipped + 1, self.samples), self.base + skipped * self.stride + self.offset
        chunks = np.ndarray(shape, dtype, raw.data, at, (self.stride, dtype.itemsize))
        start, stop = start - skipped * self.samples, stop - last * self.samples
        if len(chunks) == 1:
            return chunks[0, start:stop]
        return np.concatenate([chunks[0, start:], chunks[1:-1].ravel(), chunks[-1, :stop]])


def _raw_values(path: Path, runs: Sequence[_Run], dtype: np.dtype[Any], length: int) -> LazyArray:
    """The first `length` raw values of a channel; the file is mapped anew for each piece, so that pages are dropped."""
    ends = np.cumsum([run.rows for run in runs])

    def read(rows: slice) -> np.ndarray:
        start, stop, _ = rows.indices(length)
        values, raw = np.empty(stop - start, dtype), np.memmap(path, np.uint8, "r")
        first, last = np.searchsorted(ends, (start, stop - 1), side="right")
        for i in range(first, last + 1):
            before = int(ends[i]) - runs[i].rows
            low, high = max(start, before), min(stop, int(ends[i]))
            part = runs[i].values(raw, low - before, high - before, dtype)
            values[low - start : high - start] = part[list(dtype.names)] if dtype.names else part
        return values

    return LazyArray((length,), dtype, read)


def _runs(file: "TdmsFile", path: str) -> list[_Run] | None:
    """The runs of the channel at `path`; None if some data are raw DAQmx data."""
    from nptdms.common import toc_properties
    from nptdms.daqmx import DaqmxSegmentObject

    runs: list[_Run] = []
    for segment in _segments(file):
        here = segment.get_segment_object(path)
        if here is None or not here.has_data or not segment.num_chunks:
            continue
        if isinstance(here, DaqmxSegmentObject):
            return None
        big = bool(segment.toc_mask & toc_properties["kTocBigEndian"])
        interleaved = bool(segment.toc_mask & toc_properties["kTocInterleavedData"])
        for run in _runs_of_segment(segment, path, interleaved):
            base, stride, offset, samples, chunks = map(int, run)
            runs.append(_Run(base, stride, offset, samples, chunks, big))
    return runs


def _runs_of_segment(segment: Any, path: str, interleaved: bool) -> Iterator[tuple[int, int, int, int, int]]:
    """Base, stride, offset, samples, chunks of the runs in a segment: its whole chunks, and an incomplete last one."""
    objects = [o for o in segment.ordered_objects if o.has_data]
    at = next(i for i, o in enumerate(objects) if o.path == path)
    here, before = objects[at], objects[:at]
    kept = segment.final_chunk_lengths_override
    whole = segment.num_chunks - (kept is not None)
    rest = kept.get(path, 0) if kept is not None else 0
    if interleaved:
        if any(o.number_values != here.number_values for o in objects):
            raise ValueError("interleaved channels of different lengths")
        width, offset = (sum(o.data_type.size for o in some) for some in (objects, before))
        yield segment.data_position, width, offset, 1, here.number_values * whole + rest
        return
    stride, offset = (sum(o.data_size for o in some) for some in (objects, before))
    if whole and here.number_values:
        yield segment.data_position, stride, offset, here.number_values, whole
    if rest and kept is not None:
        parts = [(o, kept.get(o.path, 0)) for o in before]
        offset = sum(o.data_size if n == o.number_values else o.data_type.size * n for o, n in parts)
        yield segment.data_position + whole * stride, offset + rest * here.data_type.size, offset, rest, 1


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

    def item(self, group: str, zero: np.datetime64 | None) -> NamedArray:
        """Return it as a column; `zero` is the date and time of its zero."""
        note = f"{self.name}: from wf_increment = {self.step:g} and wf_start_offset = {self.start:g}"
        ramp = LazyArray((self.rows,), float, lambda rows: self.start + self.step * np.arange(*rows.indices(self.rows)))
        start = str(zero) if zero is not None and self.unit == "s" else ""
        item = NamedArray(self.name, ramp, self.unit, group=group, along=str(self), first=True, notes=[note])
        return replace(item, computed=True, start=start)


def _with_clock(items: Sequence[NamedArray], properties: Mapping[str, _Properties]) -> list[NamedArray]:
    """The channels of a group, after their times if no channel is the time.

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
    return [*(clock.item(items[0].group, zero) for clock in known), *timed]


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

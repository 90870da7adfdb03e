"""Channels of a TDMS file as arrays: raw values from the file, scaled by npTDMS, times in seconds since the first."""

from collections import defaultdict
from collections.abc import Iterator
from typing import TYPE_CHECKING, Any, BinaryIO

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows
from nectosome.measure.formats.cf_attributes import text
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.named_arrays import NamedArray, SkippedEntry, classify

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile, TdmsGroup
    from nptdms.tdms_segment import TdmsSegment

_SPAN = np.dtype([(name, np.int64) for name in ("base", "stride", "offset", "count", "chunks", "big")])
_WIDE = 2**16  # bytes of a chunk from which on a channel's part is read by itself
_BATCH = 2**25  # most bytes read at once

STAMP = np.dtype([("fractions", "<u8"), ("seconds", "<i8")])
"""A time: seconds since 1904, and fractions of 2^-64 s."""

_EPOCH = np.datetime64("1904-01-01T00:00:00", "us")
_UNITS = ("unit_string", "unit", "NI_UnitDescription")


class Bytes:
    """A file that caches its last read, which every channel of interleaved data needs."""

    def __init__(self, file: BinaryIO):
        self._file, self._last, self._read = file, (0, 0), b""

    def read(self, position: int, size: int) -> bytes:
        """Return `size` bytes from `position` on. Raises EOFError if there are fewer."""
        if self._last != (position, size):
            self._file.seek(position)
            self._last, self._read = (position, size), self._file.read(size)
        if len(self._read) < size:
            raise EOFError
        return self._read


class Spans:
    """The raw values of a channel, in runs of equal chunks.

    A run of `chunks` begins at byte `base`. Each chunk has `stride` bytes; `count` values of the channel begin at its
    byte `offset`. An interleaved segment is a run of chunks with one value of each channel.
    """

    def __init__(self, file: Bytes, spans: list[tuple[int, ...]], dtype: np.dtype[Any]):
        self._file, self._spans = file, np.array(spans, _SPAN)
        self._ends = np.cumsum(self._spans["count"] * self._spans["chunks"])
        self.shape, self.dtype = (int(self._ends[-1]) if spans else 0,), dtype

    def __getitem__(self, rows: slice) -> np.ndarray:
        start, stop, _ = rows.indices(self.shape[0])
        values = np.empty(max(stop - start, 0), self.dtype)
        row = start
        while row < stop:
            i = int(np.searchsorted(self._ends, row, side="right"))
            end = min(stop, int(self._ends[i]))
            skipped = row - (int(self._ends[i - 1]) if i else 0)
            self._fill(values[row - start : end - start], skipped, *map(int, self._spans[i].item()))
            row = end
        return values

    def _fill(
        self, values: np.ndarray, first: int, base: int, stride: int, offset: int, count: int, chunks: int, big: int
    ) -> None:
        """Read values of one run, from its value number `first` on."""
        dtype = _big_endian(self.dtype) if big else self.dtype
        done = 0
        while done < len(values):
            chunk, skip = divmod(first + done, count)
            if stride >= _WIDE:
                needed = min(count - skip, len(values) - done, _BATCH // dtype.itemsize)
                position = base + chunk * stride + offset + skip * dtype.itemsize
                read = np.frombuffer(self._file.read(position, needed * dtype.itemsize), dtype)
            else:
                several = min(-(-(skip + len(values) - done) // count), _BATCH // stride)
                raw = np.frombuffer(self._file.read(base + chunk * stride, several * stride), np.uint8)
                own = raw.reshape(several, stride)[:, offset : offset + count * dtype.itemsize]
                read = own.copy().view(dtype).ravel()[skip : skip + len(values) - done]
            values[done : done + len(read)] = read[list(self.dtype.names)] if self.dtype.names else read
            done += len(read)


def spans(segments: "list[TdmsSegment]", path: str) -> list[tuple[int, ...]] | None:
    """Return the runs of the channel at `path` for `Spans`; None if some data are raw DAQmx data."""
    from nptdms.common import toc_properties
    from nptdms.daqmx import DaqmxSegmentObject

    runs: list[tuple[int, ...]] = []
    for segment in segments:
        here = segment.get_segment_object(path)
        if here is None or not here.has_data or not segment.num_chunks:
            continue
        if isinstance(here, DaqmxSegmentObject):
            return None
        big = int(bool(segment.toc_mask & toc_properties["kTocBigEndian"]))
        runs += [(*run, big) for run in _runs(segment, path, segment.toc_mask & toc_properties["kTocInterleavedData"])]
    return runs


def _runs(segment: Any, path: str, interleaved: int) -> Iterator[tuple[int, int, int, int, int]]:
    """Base, stride, offset, count, chunks of the runs in a segment: its whole chunks, and an incomplete last one."""
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


def _big_endian(dtype: np.dtype[Any]) -> np.dtype[Any]:
    return np.dtype([("seconds", ">i8"), ("fractions", ">u8")]) if dtype.names else dtype.newbyteorder(">")


class Scaled:
    """A channel with its sensor's scaling."""

    def __init__(self, raw: Spans, scaling: Any):
        self.shape, self.dtype, self._raw, self._scaling = raw.shape, np.dtype(float), raw, scaling

    def __getitem__(self, rows: slice) -> np.ndarray:
        from nptdms.base_segment import RawChannelDataChunk

        return self._scaling.scale(RawChannelDataChunk.channel_data(self._raw[rows]))


class Stamps:
    """A channel of times, in seconds since the first."""

    def __init__(self, raw: Spans):
        self.shape, self.dtype, self._raw, self._first = raw.shape, np.dtype(float), raw, raw[0:1]

    @property
    def first(self) -> np.datetime64:
        """The first time, in UTC."""
        seconds, fractions = int(self._first["seconds"][0]), int(self._first["fractions"][0])
        return _EPOCH + np.timedelta64(seconds * 10**6 + (fractions * 10**6 >> 64), "us")

    def __getitem__(self, rows: slice) -> np.ndarray:
        times = self._raw[rows]
        fractions = times["fractions"] * 2.0**-64 - float(self._first["fractions"][0]) * 2.0**-64
        return (times["seconds"] - self._first["seconds"]) + fractions


class FirstRows:
    """The first rows of an array: those that all channels of an incomplete file have."""

    def __init__(self, array: ArrayRows, rows: int):
        self.shape, self.dtype, self._array = (rows,), array.dtype, array

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[rows]


class _DaqmxRaw:
    """Raw DAQmx data, decoded by npTDMS."""

    def __init__(self, channel: "TdmsChannel"):
        self.shape, self.dtype, self._channel = (len(channel),), channel.dtype, channel

    def __getitem__(self, rows: slice) -> np.ndarray:
        return np.asarray(self._channel[rows])


def channel_of(
    file: "TdmsFile",
    group: "TdmsGroup",
    channel: "TdmsChannel",
    stream: Bytes,
    segments: "list[TdmsSegment]",
    rows: int,
) -> NamedArray | SkippedEntry:
    """Return the first `rows` of a channel as a column, or the reason to skip it."""
    from nptdms import types
    from nptdms.scaling import get_scaling

    name, kind = channel.name, channel.data_type
    if kind is types.String:
        return SkippedEntry(name, "text", group.name)
    if kind is None or not rows:
        return SkippedEntry(name, "empty", group.name)
    unit = next((u for key in _UNITS if (u := text(channel.properties.get(key, "")))), "")
    runs = spans(segments, channel.path)
    if runs is None:
        return classify(name, FirstRows(_DaqmxRaw(channel), rows), group.name, unit=unit)
    stamped = kind is types.TimeStamp
    raw = Spans(stream, runs, STAMP if stamped else np.dtype(kind.nptype).newbyteorder("<"))
    if raw.shape != (len(channel),):
        raise ValueError("the position of the channel does not agree with its length")
    if stamped:
        times = Stamps(raw)
        note = f"{name}: seconds since {times.first} UTC"
        return classify(name, FirstRows(times, rows), group.name, unit="s", notes=[note], first=True)
    scaling = get_scaling(channel.properties, group.properties, file.properties)
    values = FirstRows(raw if scaling is None or raw.dtype.kind == "c" else Scaled(raw, scaling), rows)
    return classify(name, values, group.name, unit=unit, first=is_time(name))


def whole_rows(file: "TdmsFile") -> dict[str, int]:
    """Return the common number of rows of channels that were written together, by path, for an incomplete file."""
    statuses = file.file_status.channel_statuses or {}
    ends: dict[tuple[str, int, int], dict[str, int]] = defaultdict(dict)
    for group in file.groups():
        for channel in group.channels():
            if (status := statuses.get(channel.path)) is not None:
                before = len(channel) - status.read_length
                ends[group.name, before, status.expected_length][channel.path] = len(channel)
    return {path: min(together.values()) for together in ends.values() for path in together}

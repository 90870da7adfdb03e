"""The channels of a TDMS file as arrays: scaled as npTDMS does it, times as seconds since the first."""

from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.measure.formats.arrays import Rows
from nectosome.measure.formats.conventions import text
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.items import Item, Other, item_of
from nectosome.measure.formats.tdms_spans import STAMP, Bytes, Spans, spans

if TYPE_CHECKING:
    from nptdms import TdmsChannel, TdmsFile, TdmsGroup
    from nptdms.tdms_segment import TdmsSegment

_EPOCH = np.datetime64("1904-01-01T00:00:00", "us")
_UNITS = ("unit_string", "unit", "NI_UnitDescription")


class Scaled:
    """A channel in the unit of its sensor."""

    def __init__(self, raw: Spans, scaling: Any):
        self.shape, self.dtype, self._raw, self._scaling = raw.shape, np.dtype(float), raw, scaling

    def __getitem__(self, rows: slice) -> np.ndarray:
        from nptdms.base_segment import RawChannelDataChunk

        return self._scaling.scale(RawChannelDataChunk.channel_data(self._raw[rows]))


class Stamps:
    """A channel of times, in seconds since its first one."""

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


class Whole:
    """The first rows of an array: those that all channels have where a file breaks off."""

    def __init__(self, array: Rows, rows: int):
        self.shape, self.dtype, self._array = (rows,), array.dtype, array

    def __getitem__(self, rows: slice) -> np.ndarray:
        return self._array[rows]


class _Sliced:
    """Raw data of DAQmx, which npTDMS takes apart."""

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
) -> Item | Other:
    """Return a channel with that many rows as a column, or what it is instead."""
    from nptdms import types
    from nptdms.scaling import get_scaling

    name, kind = channel.name, channel.data_type
    if kind is types.String:
        return Other(name, "text", group.name)
    if kind is None or not rows:
        return Other(name, "empty", group.name)
    unit = next((u for key in _UNITS if (u := text(channel.properties.get(key, "")))), "")
    runs = spans(segments, channel.path)
    if runs is None:
        return item_of(name, Whole(_Sliced(channel), rows), group.name, unit=unit)
    stamped = kind is types.TimeStamp
    raw = Spans(stream, runs, STAMP if stamped else np.dtype(kind.nptype).newbyteorder("<"))
    if raw.shape != (len(channel),):
        raise ValueError("the channel is not where its length says")
    if stamped:
        times = Stamps(raw)
        note = f"{name}: seconds since {times.first} UTC"
        return item_of(name, Whole(times, rows), group.name, unit="s", notes=[note], first=True)
    scaling = get_scaling(channel.properties, group.properties, file.properties)
    values = Whole(raw if scaling is None or raw.dtype.kind == "c" else Scaled(raw, scaling), rows)
    return item_of(name, values, group.name, unit=unit, first=is_time(name))


def whole_rows(file: "TdmsFile") -> dict[str, int]:
    """Return how many rows all channels have that were written together, by path, where the file breaks off."""
    statuses = file.file_status.channel_statuses or {}
    ends: dict[tuple[str, int, int], dict[str, int]] = defaultdict(dict)
    for group in file.groups():
        for channel in group.channels():
            if (status := statuses.get(channel.path)) is not None:
                before = len(channel) - status.read_length
                ends[group.name, before, status.expected_length][channel.path] = len(channel)
    return {path: min(together.values()) for together in ends.values() for path in together}

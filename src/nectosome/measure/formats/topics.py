"""Tables of topics: messages, one by one, become columns over the times of their topic.

Topics of the same times are one table; several stand side by side, and each column has the times of its own.
"""

from array import array
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from jaxtyping import Int

from nectosome.measure.formats.file_errors import check_columns, check_memory
from nectosome.measure.formats.headings import distinct, split_known_unit
from nectosome.measure.formats.messages import LONGEST, StampedMessage, numbers, parts_of, plain, short_kind
from nectosome.measure.formats.source import Column, Options, Piece, TableSource
from nectosome.units import InputError, count, did_you_mean, shorten

Decoder = Callable[[bytes], Any]

_BIGGEST = 100_000  # bytes of a message: more is a picture, a cloud of points or the like
_DATES = 1e18, 4.1e18  # [ns], the years 2001 to 2099: times within are UNIX times, others count from their own zero
_LISTED = 4
_EXACT = 2**53  # up to this, every integer is a float
_NO_MEASUREMENTS = {
    "sensor_msgs/Image": "pictures",
    "sensor_msgs/CompressedImage": "pictures",
    "sensor_msgs/PointCloud2": "clouds of points",
    "foxglove.RawImage": "pictures",
    "foxglove.CompressedImage": "pictures",
    "foxglove.CompressedVideo": "a video",
    "foxglove.PointCloud": "clouds of points",
    "rcl_interfaces/Log": "text",
    "rcl_interfaces/ParameterEvent": "parameters",
}


class Message(NamedTuple):
    """A message as a file has it."""

    topic: int  # which one, by its number in the file
    logged: int  # when it was recorded [ns]
    data: bytes


@dataclass
class Topic:
    """A topic of a file, and how its messages are decoded."""

    name: str
    kind: str  # type of its messages
    decode: Decoder | None = None
    left_out: str = ""  # why it is not read
    units: Mapping[str, str] = field(default_factory=dict)  # of its fields, where the file says them
    messages: int = 0
    too_big: int = 0
    columns: int = 0  # of its numbers

    def __str__(self) -> str:
        return f"{self.name} ({', '.join(filter(None, (self.kind, count(self.messages, 'message'))))})"

    @property
    def is_read(self) -> bool:
        """Whether all of it is read."""
        return self.columns > 0 and not self.left_out and not self.too_big

    @property
    def lacks(self) -> str:
        """It, and why it is not read, or not all of it."""
        if self.left_out:
            return f"{self}: {self.left_out}"
        if self.too_big:
            return f"{self}: {self.too_big} of more than {_BIGGEST // 1000} kB"
        return f"{self}: no numbers" + (f", or more than {LONGEST} in an array" if self.messages else "")


@dataclass
class _Table:
    """The numbers of a topic, or of a frame of it, with the times of each row."""

    name: str
    kind: str
    stamped_by: str  # the field with the time; "" where a message has none
    logged: "array[int]" = field(default_factory=lambda: array("q"))  # [ns]
    stamps: "array[int]" = field(default_factory=lambda: array("q"))  # [ns]
    columns: "dict[str, array[float]]" = field(default_factory=dict)
    units: dict[str, str] = field(default_factory=dict)
    rounded: set[str] = field(default_factory=set)  # columns with integers that are no floats

    def add(self, logged: int, part: StampedMessage, units: Mapping[str, str]) -> int:
        """Append a row; by how many numbers that grows."""
        rows, before = len(self.logged), len(self.columns)
        for name, value, unit in numbers(part):
            if name not in self.columns:
                self.columns[name] = array("d", [np.nan]) * rows
                self.units[name] = units.get(name, unit)
            column = self.columns[name]
            if len(column) == rows:
                column.append(value)
            if isinstance(value, int) and abs(value) > _EXACT:
                self.rounded.add(name)
        for column in self.columns.values():
            if len(column) == rows:
                column.append(np.nan)
        self.logged.append(logged)
        if part.stamp is not None:
            self.stamps.append(part.stamp)
        return 2 + len(self.columns) + rows * (len(self.columns) - before)

    @property
    def clock(self) -> str:
        """What its times are: the field of its messages, or, where that is not set, when they were recorded."""
        unset = self.stamps.count(0)
        begins = unset == 1 and max(self.stamps) < _DATES[0]  # a clock that begins at 0
        return self.stamped_by if len(self.stamps) == len(self.logged) and (begins or not unset) else "log_time"

    def sort(self) -> Int[np.ndarray, "n"]:
        """Put rows into the order in which they were recorded, as parts of a file may overlap; their times [ns]."""
        order = np.argsort(np.frombuffer(self.logged, np.int64), kind="stable")
        self.columns = {
            name: array("d", np.frombuffer(column)[order].tobytes()) for name, column in self.columns.items()
        }
        return np.frombuffer(self.logged if self.clock == "log_time" else self.stamps, np.int64)[order]


class TopicSource(TableSource):
    """All topics of a file with numbers, or the one of `options.table`; that with the most messages comes first."""

    def __init__(
        self,
        reader: str,
        topics: Mapping[int, Topic],
        messages: Iterable[Message],
        options: Options,
        repairs: list[str],
    ):
        """Read all messages once, and keep their numbers.

        Raises InputError for none, for a topic that is not there, for a message that is not as its definition says,
        and where the numbers take more than `options.memory`.
        """
        self.reader, self.repairs = reader, repairs
        full = _read(topics, messages, options)
        tables = [table for table in full if len(table.logged) > 1] or full
        by_times: dict[bytes, list[_Table]] = {}
        for table in tables:
            by_times.setdefault(table.sort().tobytes(), []).append(table)
        groups = [(np.frombuffer(times, np.int64), group) for times, group in by_times.items()]
        groups.sort(key=lambda group: -len(group[0]))
        check_columns(sum(1 + sum(len(table.columns) for table in group) for _, group in groups))
        dated = [_DATES[0] <= times[0] <= _DATES[1] for times, _ in groups]
        zero = next((times[0] for (times, _), is_date in zip(groups, dated, strict=True) if is_date), np.int64(0))
        columns, clocks = list[Column](), dict[int, int]()
        self._values: list[list[np.ndarray]] = []  # of each group its times and numbers
        for (times, group), is_date in zip(groups, dated, strict=True):
            clock, first = f"{group[0].name}.{group[0].clock}", len(columns)
            start = str(pd.Timestamp(zero, unit="ns", tz="UTC")) if is_date else ""
            columns.append(Column(clock, "s", clock, start=start))
            self._values.append([(times - zero if is_date else times) / 1e9])
            for table in group:
                for name, values in table.columns.items():
                    clocks[len(columns)] = first
                    heading = f"{table.name}.{name}"
                    columns.append(split_known_unit(Column(heading, table.units[name], heading, len(clocks))))
                    self._values[-1].append(np.frombuffer(values))
                repairs += [f"{table.name}.{name}: integers beyond 2^53 are rounded." for name in sorted(table.rounded)]
        self.columns, self.times = distinct(columns), clocks
        left_out = [f"left out: {table.name} ({table.kind}): a single message" for table in full if table not in tables]
        left_out += [f"left out: {topic.lacks}" for topic in topics.values() if not topic.is_read]
        self.found = (*(note for _, group in groups for note in _found(group)), *left_out)

    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield rows: the first message of each topic, the second of each, and so on."""
        length = max(len(group[0]) for group in self._values)
        for start in range(0, length, rows):
            stop = min(start + rows, length)
            values = np.full((stop - start, len(self.columns)), np.nan)
            k = 0
            for group in self._values:
                for column in group:
                    part = column[start:stop]
                    values[: len(part), k] = part
                    k += 1
            yield Piece(np.arange(start + 1, stop + 1), values)

    def close(self) -> None:
        """Do nothing: the file was read as a whole."""


def _found(tables: list[_Table]) -> Iterator[str]:
    """What tables of the same times are, by which clock, and what is open."""
    names = [f"{table.name} ({table.kind})" if table.kind else table.name for table in tables]
    listed = ", ".join(names[:_LISTED]) + (f" and {len(names) - _LISTED} more" if len(names) > _LISTED else "")
    clock = "the log" if tables[0].clock == "log_time" else tables[0].clock
    unset = [table.stamped_by for table in tables if table.stamped_by not in ("", table.clock)]
    yield f"{listed}: {count(len(tables[0].logged), 'message')}, times of {clock}" + (
        f", as {unset[0]} is not set" if unset else ""
    )
    for table in tables:
        if short_kind(table.kind) == "sensor_msgs/JointState":
            yield f"{table.name}: turns or ways, which it does not say: write the unit in a sheet, as in unit: rad"


def _read(topics: Mapping[int, Topic], messages: Iterable[Message], options: Options) -> list[_Table]:
    """The tables of a file, in its order."""
    tables, size = dict[tuple[str, str], _Table](), 0
    chosen = None if options.table is None else plain(options.table)
    for message in messages:
        topic = topics[message.topic]
        topic.messages += 1
        if chosen not in (None, plain(topic.name)):
            topic.left_out = "another one is chosen"
        if topic.left_out or topic.decode is None:
            continue
        if len(message.data) > _BIGGEST:
            topic.too_big += 1
            continue
        for part in _decoded(topic, topic.decode, message.data):
            name = ".".join(filter(None, (plain(topic.name), plain(part.name))))
            table = tables.setdefault((name, topic.kind), _Table(name, topic.kind, part.stamped_by))
            size += 8 * table.add(message.logged, part, topic.units)
            topic.columns = max(topic.columns, len(table.columns))
            check_memory([size], options.memory, "the numbers of its messages take")
    names = [topic.name for topic in topics.values()]
    if chosen is not None and chosen not in map(plain, names):
        raise InputError(f'there is no topic called "{shorten(chosen)}".{did_you_mean(chosen, names)}')
    full = [table for table in tables.values() if table.columns]
    if not full:
        inside = "; ".join(topic.lacks for topic in topics.values()) or "no topic"
        what = "Messages of ROS 2 (cdr) and in JSON are read: record the others as one of these"
        raise InputError(f"holds no numbers that can be read. {what}. Inside: {inside}.")
    return full


def _decoded(topic: Topic, decode: Decoder, data: bytes) -> list[StampedMessage]:
    """The parts of a message. Raises InputError for one that is not as its definition says."""
    try:
        return list(parts_of(topic.kind, decode(data)))
    except NotImplementedError as error:  # a type of field that mcap_ros2 does not know
        topic.left_out = shorten(str(error))
        return []
    except Exception as error:  # a decoder raises whatever damaged bytes lead to
        where = f"message {topic.messages} of {topic.name} is not as {shorten(topic.kind)} is defined"
        raise InputError(f"{where}: the file is damaged, or its definition is not that of its messages.") from error


def not_measured(kind: str) -> str:
    """What messages of a type hold that are no measurements over time; "" for others."""
    return _NO_MEASUREMENTS.get(short_kind(kind), "")

"""Quantities with one clock, piece by piece: their times and values, and what is noted of them.

Noted are times out of order, gaps, missing and saturated values.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError, count

from .channels import Channel, find_time
from .clock import Clock
from .formats.source import TableSource
from .sheet import Time
from .wraps import Jumps, Wrap, wrap_by_sheet, wraps_of

_GAP = 5.0  # [median interval]
_LOST = 1.5  # [median interval], from which on samples seem lost
_FEW = 0.05  # of the intervals: where more are so long, samples were not taken evenly
_STUCK = 10  # consecutive samples at the largest or smallest value that suggest saturation


@dataclass
class TimeCheck:
    """Checks that times increase, and records their intervals."""

    file: str
    column: str
    label: str = "time"  # where the sheet tells of the clock
    drop: bool = False  # rows whose time does not increase, in place of refusing the file
    count: int = 0
    first: float = np.nan
    last: float = np.nan
    median_step: float = np.nan  # [s], of the first piece
    shortest: float = np.inf
    longest: float = 0.0
    dropped: list[int] = field(default_factory=list)  # rows
    lost: list[tuple[int, int]] = field(default_factory=list)  # samples, row after them
    gaps: list[tuple[float, float, int]] = field(default_factory=list)  # start, end [s], row after it

    def keep(self, rows: Int[np.ndarray, "n"], time: Float[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
        """Mask of the rows whose time increases. Raises InputError for the first other row, unless they are dropped."""
        before = -np.inf if self.count == 0 else self.last
        valid = np.isfinite(time)
        highest = np.maximum.accumulate(np.where(valid, time, -np.inf))
        valid &= time > np.maximum(before, np.concatenate([[-np.inf], highest[:-1]]))
        if not valid.all():
            if not self.drop:
                raise self._refusal(int(np.argmin(valid)), rows, time, before)
            self.dropped += rows[~valid].tolist()
        self._record(rows[valid], time[valid])
        return valid

    def _refusal(self, k: int, rows: np.ndarray, time: np.ndarray, before: float) -> InputError:
        previous = time[k - 1] if k else before
        if not np.isfinite(time[k]):
            what = "the time is missing" if np.isnan(time[k]) else "the time is infinite"
        elif time[k] == previous:
            what = f"the time {time[k]:.9g} s occurs twice"
        else:
            what = f"the time {time[k]:.9g} s comes after {previous:.9g} s"
        remedy = f"Correct the file, or write under {self.label} in a sheet repair: drop, which leaves such rows out"
        if np.isfinite(time[k]):
            remedy += (
                ", or repair: shift, which counts on where a clock was set back, with gap or host, how long it stood"
            )
        remedy += "."
        return InputError(f"{what}. {remedy}", file=self.file, line=int(rows[k]), field=self.column)

    def _record(self, rows: np.ndarray, time: np.ndarray) -> None:
        if not time.size:
            return
        joined = time if self.count == 0 else np.concatenate([[self.last], time])
        after = rows[1:] if self.count == 0 else rows
        steps = np.diff(joined)
        if np.isnan(self.median_step) and steps.size:
            self.median_step = float(np.median(steps))
        if steps.size:
            self.shortest, self.longest = min(self.shortest, steps.min()), max(self.longest, steps.max())
            long = (steps > _LOST * self.median_step) & (steps <= _GAP * self.median_step)
            many = np.round(steps[long] / self.median_step).astype(int) - 1
            self.lost += list(zip(many.tolist(), after[long].tolist(), strict=True))
            for k in np.flatnonzero(steps > _GAP * self.median_step):
                self.gaps.append((float(joined[k]), float(joined[k + 1]), int(after[k])))
        if self.count == 0:
            self.first = float(time[0])
        self.last, self.count = float(time[-1]), self.count + time.size

    @property
    def lost_samples(self) -> tuple[int, int]:
        """How many samples seem lost within gaps that are shorter than those listed, and the row after the first."""
        few = 0 < len(self.lost) <= _FEW * self.count
        return (sum(n for n, _ in self.lost), self.lost[0][1]) if few else (0, 0)

    @property
    def even(self) -> bool:
        """Whether all intervals are equal within 1 in 1000."""
        return self.count > 2 and self.longest - self.shortest <= 1e-3 * self.median_step


@dataclass
class ValueCheck:
    """Records of one quantity its missing and saturated values, its minimum, maximum and mean."""

    name: str
    count: int = 0
    total: float = 0.0
    smallest: float = np.inf
    largest: float = -np.inf
    has_others: bool = False  # whether there are values between these two
    missing: list[int] = field(default_factory=list)  # the first rows
    missing_count: int = 0
    saturated_count: int = 0
    saturated: int | None = None  # first row
    stuck: dict[float, tuple[int, int]] = field(default_factory=dict)  # by extreme: longest run of samples, its row

    def check(
        self, rows: Int[np.ndarray, "n"], cells: Float[np.ndarray, "n"], low: float, high: float
    ) -> Float[np.ndarray, "n"]:
        """Cells with NaN in place of saturated or infinite values; all of these are counted."""
        lost = ~np.isfinite(cells) | (cells <= low) | (cells >= high)
        present = cells
        if lost.any():
            present, missing = cells[~lost], np.isnan(cells)
            self.missing_count += int(missing.sum())
            self.missing += rows[missing][: max(0, 5 - len(self.missing))].tolist()
            over = lost & ~missing
            if over.any():
                self.saturated_count += int(over.sum())
                self.saturated = int(rows[np.argmax(over)]) if self.saturated is None else self.saturated
                cells = np.where(over, np.nan, cells)
        if present.size:
            self.count, self.total = self.count + present.size, self.total + float(present.sum())
            ends = float(present.min()), float(present.max())
            known = present if self.has_others else np.append(present, [self.smallest, self.largest])
            self.smallest, self.largest = min(self.smallest, ends[0]), max(self.largest, ends[1])
            self.has_others |= bool(((known > self.smallest) & (known < self.largest)).any())
            for extreme in ends:
                self._count_stuck(rows, cells == extreme, extreme)
        return cells

    def _count_stuck(self, rows: np.ndarray, at: np.ndarray, extreme: float) -> None:
        if np.count_nonzero(at) < _STUCK:
            return
        edges = np.flatnonzero(np.diff(np.concatenate([[0], at.astype(np.int8), [0]])))
        lengths = edges[1::2] - edges[::2]
        k = int(np.argmax(lengths))
        if lengths[k] >= _STUCK and lengths[k] > self.stuck.get(extreme, (0, 0))[0]:
            self.stuck[extreme] = (int(lengths[k]), int(rows[edges[2 * k]]))

    @property
    def mean(self) -> float:
        """Mean of the values present."""
        return self.total / self.count if self.count else np.nan

    def clipped(self) -> list[tuple[float, int, int]]:
        """Extremes [cell unit] at which the reading stayed, the number of samples, and the first row.

        None of what has two values only, as a trigger has.
        """
        if not self.has_others:
            return []
        ends = {self.smallest, self.largest}
        return [(value, n, row) for value, (n, row) in self.stuck.items() if value in ends]


class TimedChannels:
    """Columns of a file that one clock, or one rate, times.

    The clock is that of a sheet's `settings`; without these, that of the file, if it has one. `label` is where the
    sheet tells of it: `time`, or `clocks.camera`. Where the file `has_gaps`, rows without a time and readings are none
    of its samples, as other devices have more; `is_shared`: the times are those of another device, too. Raises
    InputError for a column that is not there.
    """

    def __init__(
        self,
        source: TableSource,
        settings: Time | None,
        channels: list[Channel],
        file: str,
        label: str = "time",
        clock: Clock | None = None,
        has_gaps: bool = False,
        is_shared: bool = False,
    ):
        self.clock, self.channels = clock or find_time(source, settings, file, label), channels
        self.rate = settings.rate if settings is not None else source.rate  # [Hz], where no column is the time
        self.offset = settings.offset if settings is not None else 0.0  # [s], added to the times of a rate
        self.has_gaps, self.is_shared, self.rows = has_gaps, is_shared, 0
        drop = settings is not None and settings.repair == "drop"
        self.time_check = TimeCheck(file, self.clock.column.name if self.clock else "", label, drop)
        self.value_checks = [ValueCheck(channel.name) for channel in channels]
        self.wraps = [_wraps(channel) for channel in channels]  # of each channel, what may have happened
        self.jumps = [Jumps() for _ in channels]

    @property
    def is_timed(self) -> bool:
        """Whether there is a time; else rows count."""
        return self.clock is not None or bool(self.rate)

    def piece(
        self, rows: Int[np.ndarray, "n"], values: Float[np.ndarray, "n k"]
    ) -> tuple[Float[np.ndarray, "m"], list[Float[np.ndarray, "m"]]]:
        """Times [s] (or row numbers) and quantities [SI] of consecutive rows of the file."""
        if self.clock is not None:
            if self.has_gaps:
                times = [] if self.is_shared else [self.clock.index]
                own = values[:, [*times, *(channel.index for channel in self.channels)]]
                there = ~np.isnan(own).all(axis=1)
                rows, values = rows[there], values[there]
            time = self.clock.seconds(rows, values)
            keep = self.time_check.keep(rows, time)
            if not keep.all():
                rows, time, values = rows[keep], time[keep], values[keep]
        else:
            time = np.arange(self.rows, self.rows + rows.size, dtype=float)
            if self.rate:
                time = time / self.rate + self.offset
                self.time_check.keep(rows, time)
        self.rows += rows.size
        interval = self.time_check.median_step
        at = time / interval if np.isfinite(interval) else np.arange(self.rows - rows.size, self.rows, dtype=float)
        columns = np.ascontiguousarray(values.T)
        out = []
        each = zip(self.channels, self.value_checks, self.wraps, self.jumps, strict=True)
        for channel, check, wraps, jumps in each:
            cells = columns[channel.index]
            jumps.look_at(cells, at)
            whole = [wrap.take(cells, at) for wrap in wraps]
            if channel.counted is not None:
                cells = whole[0] + channel.counted[1]
            cells = check.check(rows, cells, channel.low, channel.high)
            out.append(channel.convert(cells))
        return time, out

    def started_again(self) -> dict[str, tuple[float, float]]:
        """Period and shift of the channels whose cells started again, by name, where they do not go on yet."""
        again = {}
        for channel, wraps in zip(self.channels, self.wraps, strict=True):
            certain = [w for w in wraps if w.happened and not w.is_asked]
            if channel.wrap:
                certain = [w for w in wraps if w.possible and (w.times or w.shift)]
            if channel.counted is None and certain:
                again[channel.name] = certain[0].period, certain[0].shift
        return again

    def attributes(self) -> list[dict[str, Any]]:
        """What a recording says of each variable."""
        return [_attributes(channel, check) for channel, check in zip(self.channels, self.value_checks, strict=True)]

    def conversions(self) -> list[str]:
        """Conversions to SI, in words."""
        notes = [f"{c.name}: {c.conversion}" for c in self.channels if c.conversion]
        if self.clock is not None and self.clock.conversion:
            notes.insert(0, f"{self.clock.label}: {self.clock.conversion}")
        return notes

    def repairs(self) -> list[str]:
        """What was mended, in sentences with rows."""
        notes = self.clock.repairs() if self.clock else []
        if self.time_check.dropped:
            n, first = len(self.time_check.dropped), self.time_check.dropped[0]
            notes.append(
                f"{count(n, 'row')} left out: {self.time_check.label} does not increase; the first is row {first}"
            )
        for check in self.value_checks:
            if check.saturated_count:
                rows = count(check.saturated_count, "row")
                notes.append(f"{check.name}: {rows} saturated or infinite, from row {check.saturated}: now missing")
        for channel, wraps in zip(self.channels, self.wraps, strict=True):
            if channel.counted is not None:
                notes.append(f"{channel.name}: {wraps[0].told(channel.counted[1])}")
        return notes

    def oddities(self) -> list[str]:
        """Sizes of the time that are improbable, in sentences."""
        check = self.time_check
        return self.clock.oddities(check.first, check.last, check.median_step) if self.clock else []

    def warnings(self) -> list[str]:
        """Gaps, missing values and what looks saturated, in sentences with rows."""
        notes = []
        if self.time_check.gaps:
            longest = max(self.time_check.gaps, key=lambda gap: gap[1] - gap[0])
            n, length = len(self.time_check.gaps), longest[1] - longest[0]
            many = f"{n} gaps, the longest of" if n > 1 else "a gap of"
            notes.append(f"{self.time_check.label}: {many} {length:.3g} s before row {longest[2]}")
        lost, row = self.time_check.lost_samples
        if lost:
            of = f"{count(lost, 'sample')} lost of one every {self.time_check.median_step:.4g} s"
            notes.append(f"{self.time_check.label}: {of}, the first before row {row}")
        each = zip(self.channels, self.value_checks, self.wraps, self.jumps, strict=True)
        for channel, check, wraps, jumps in each:
            if check.missing_count:
                rows = count(check.missing_count, "row")
                notes.append(f"{check.name}: {rows} missing, the first is row {check.missing[0]}")
            doubts = [doubt for wrap in wraps if channel.wrap is None and (doubt := wrap.doubt())]
            # rows of a table without time have no order
            if not doubts and self.time_check.count and channel.wrap is None and channel.counted is None:
                doubts = [doubt for doubt in [jumps.doubt()] if doubt]
            if channel.wrap and not wraps[0].possible:
                doubts = [f"does not start again after {channel.wrap:g}: readings or steps do not fit; left as it is"]
            if channel.counted is not None and (unknown := wraps[0].unknown_turns()):
                doubts = [unknown]
            notes += [f"{channel.name}: {doubt}" for doubt in doubts[:1]]
            for value, n, row in check.clipped() if self.time_check.count else []:
                shown = f"{channel.slope * value + channel.shift:.6g} {channel.unit}".strip()
                notes.append(f"{check.name}: stays at its extreme {shown} for {n} rows from row {row}: saturated?")
        return notes


def _wraps(channel: Channel) -> list[Wrap]:
    """Wraps that the cells of a channel may have: what is known of it, the sheet's, any."""
    if channel.counted is not None:
        return [Wrap(channel.counted[0])]
    if channel.wrap is not None:
        return [wrap_by_sheet(channel.wrap, channel.reading)] if channel.wrap else []
    return wraps_of(channel.reading)


def _attributes(channel: Channel, check: ValueCheck) -> dict[str, Any]:
    ends = sorted(channel.slope * x + channel.shift for x in (check.smallest, check.largest))
    attributes: dict[str, Any] = {"units": channel.unit, "column": channel.source}
    if channel.error is not None:
        attributes["error"] = channel.error
    if channel.about:
        attributes["long_name"] = channel.about
    if check.count:
        mean = channel.slope * check.mean + channel.shift
        attributes |= {"minimum": ends[0], "maximum": ends[1], "mean": mean}
    return attributes | {"missing": check.missing_count + check.saturated_count}

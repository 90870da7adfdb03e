"""The time of a recording: which column it is, its unit, and seconds made of it, whatever clock wrote it.

Clocks with a date, UNIX clocks among them, count from their first sample or from `since`. A clock that starts again (at
midnight, or a counter of 16 or 32 bits) goes on; one that is set back may, by a sheet.
"""

from dataclasses import dataclass, field

import numpy as np
import pandas as pd
from jaxtyping import Float, Int

from nectosome.units import InputError, scale_to_si, shorten

from .formats.clock_text import DAY, as_utc, date_time
from .formats.source import Column
from .sheet import Time

_UNIX = (1e9, 4.1e9)  # [s], the years 2001 to 2099; in ms, µs and ns these are other numbers
_COUNTERS = {16: 2.0**16, 32: 2.0**32}  # counts by bits; millis() and micros() start again after 32 bits
_NEAR = 5.0  # [median interval] within which a clock that starts again goes on
_BESIDE = 20  # samples on either side of a restart by which a host's clock tells how long it took


@dataclass
class Clock:
    """Makes seconds of the time column's cells, piece by piece."""

    column: Column
    index: int  # of the column
    unit: str  # "" if neither the file nor the sheet says one
    file: str
    settings: Time
    label: str = "time"  # where the sheet tells of it: `time`, or `clocks.camera`
    nanoseconds: int | None = None  # index of a column to add, where `column` has whole seconds only
    factor: float = 1.0
    zero: float = 0.0  # cell at time 0
    zero_nanoseconds: float = 0.0  # beside it
    rounded: float = 0.0  # to what numbers as large as the cells are rounded [s]
    usual: float = np.nan  # median interval of the first piece [s]
    start: str = ""  # date and time at which the time is 0
    conversion: str = ""
    assumed: str = ""  # of its unit, in words
    assumed_column: str = ""  # in words, where several may be the time
    last: float = np.nan  # last time before shifts
    shift: float = 0.0
    again: dict[str, list[int]] = field(default_factory=dict)  # rows at which the clock started again, by the reason
    host: "Clock | None" = None  # a clock that went on
    ahead: Float[np.ndarray, "k"] = field(default_factory=lambda: np.zeros(0))  # the host's last times less these [s]
    back: list[int] = field(default_factory=list)  # rows before which steps back were taken out
    largest: float = 0.0  # of these steps [s]
    stood: list[float] = field(default_factory=list)  # from the sample before each to that after it [s]
    interval: float | None = None  # of the frames that a column counts [s]

    def begin(self, values: Float[np.ndarray, "n k"]) -> None:
        """Settle unit and zero by the first rows. Raises InputError for a unit that is not one of time."""
        if self.host is not None:
            self.host.begin(values)
        cells = values[:, self.index]
        first = cells[np.isfinite(cells)][:1]
        size = abs(float(first[0])) if first.size else 0.0
        if self.interval is not None:
            self.zero = float(first[0]) if first.size else 0.0
            self.factor, self.conversion = self.interval, f"frames at {1 / self.interval:g} Hz to s"
        elif not self.unit:
            unix = next((u for u in ("s", "ms", "us", "ns") if _UNIX[0] <= size * scale_to_si(u)[0] <= _UNIX[1]), None)
            self.unit = unix or "s"
            why = "by its size a UNIX clock in" if unix else "taken as"
            self.assumed = f"{self.column.name} has no unit: {why} {'seconds' if self.unit == 's' else self.unit}"
        if self.interval is None:
            self.factor = self._read_unit()
        dated = self.column.start
        if not dated and not self.column.daily and self.interval is None and _UNIX[0] <= size * self.factor <= _UNIX[1]:
            self.zero = float(first[0])
            nanoseconds = round(self.zero * self.factor * 1e9)
            if self.nanoseconds is not None:
                row = int(np.flatnonzero(np.isfinite(cells))[0])
                self.zero_nanoseconds = float(values[row, self.nanoseconds])
                nanoseconds += round(self.zero_nanoseconds)
            dated = str(pd.Timestamp(nanoseconds, unit="ns", tz="UTC").round("us"))
            self.rounded = float(np.spacing(self.zero)) * self.factor
        self.start = dated
        if self.settings.since is not None:
            if not dated:
                why = f'since needs a clock with a date, and "{shorten(self.column.name)}" has none. Use offset'
                raise InputError(f"{why}, or leave it out.", file=self.file, field=self.label)
            self.count_from(date_time(self.settings.since))
        steps = np.diff(self._seconds(values))
        forward = steps[steps > 0]
        self.usual = float(np.median(forward)) if forward.size else np.nan

    def count_from(self, since: pd.Timestamp) -> None:
        """Let a clock with a date count from an instant."""
        try:
            self.zero -= (as_utc(self.start) - since) / np.timedelta64(1, "s") / self.factor
        except ValueError:
            why = f'"{shorten(self.start)}", from which the file counts, is no known date. Leave since out.'
            raise InputError(why, file=self.file, field=self.label) from None
        self.start = str(since)

    @property
    def kind(self) -> str:
        """What its zero is, in words."""
        return "an instant" if self.start else "midnight" if self.column.daily else "the zero of a column"

    def _read_unit(self) -> float:
        try:
            factor, _, si = scale_to_si(self.unit.lower())  # "MS" is no megasiemens here
        except ValueError as error:
            how = f"Write {self._in_milliseconds()} in a sheet"
            said = f'"{shorten(self.unit)}" {error}. A unit of time is needed. {how}, or another unit of time.'
            raise InputError(said, file=self.file, field=self.label) from None
        if si != "s":
            raise InputError(
                f'"{shorten(self.unit)}" is not a unit of time, as in "ms".', file=self.file, field=self.label
            )
        self.conversion = f"{self.unit} to s" if factor != 1 else ""
        return factor

    def _in_milliseconds(self) -> str:
        """What a sheet says of a clock in ms."""
        return f'{self.label}: {{column: "{shorten(self.column.heading or self.column.name)}", unit: ms}}'

    def _seconds(self, values: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n"]:
        cells = values[:, self.index]
        time = (cells - self.zero) * self.factor if (self.zero, self.factor) != (0.0, 1.0) else cells
        return time if self.nanoseconds is None else time + 1e-9 * (values[:, self.nanoseconds] - self.zero_nanoseconds)

    def seconds(self, rows: Int[np.ndarray, "n"], values: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n"]:
        """Time [s] of consecutive rows."""
        raw = self._seconds(values)
        known = np.flatnonzero(np.isfinite(raw))
        steps = np.diff(np.concatenate([[self.last], raw[known]]))
        before = np.concatenate([[self.last], raw[known][:-1]])
        ahead = self._ahead(values[known], raw[known])
        offset, backs = ahead.size - known.size, np.flatnonzero(steps <= 0)
        added = np.zeros(raw.size)
        ends = [0, *(offset + backs).tolist(), ahead.size]  # of what is between two of these steps
        for i, k in enumerate(backs):
            sides = (ahead[ends[i] : ends[i + 1]], ahead[ends[i + 1] : ends[i + 2]]) if ahead.size else None
            added[known[k]] = self._added(float(before[k]), float(steps[k]), int(rows[known[k]]), sides)
        self.ahead = ahead[ends[-2] :][-_BESIDE:]
        moved = self.shift + np.cumsum(added) if added.any() else self.shift
        self.shift = float(np.ravel(moved)[-1])
        self.last = float(raw[known[-1]]) if known.size else self.last
        return raw + (moved + self.settings.offset) if self.shift or self.settings.offset else raw

    def _ahead(self, values: Float[np.ndarray, "n k"], raw: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m"]:
        """The host's times less those of this clock, after the last ones of the rows before; none without a host."""
        if self.host is None:
            return self.ahead
        return np.concatenate([self.ahead, self.host.seconds(np.arange(raw.size), values) - raw])

    def _added(self, before: float, step: float, row: int, ahead: "tuple[np.ndarray, np.ndarray] | None") -> float:
        """What is added to all times from a row on whose time is not later than the one before.

        `ahead` are the host's times less those of this clock, before the row and from it on. Raises InputError where
        nothing tells how long the clock stood.
        """
        periods = {"midnight passes": DAY} if 0 <= before + step <= before <= DAY else {}
        if self.factor <= 1e-3 and not self.zero:
            for bits, counts in _COUNTERS.items():
                if before < counts * self.factor:
                    periods[f"the counter of {bits} bits starts again"] = counts * self.factor
        near = {what for what, period in periods.items() if 0 < step + period <= _NEAR * self.usual}
        if self.column.daily and step < -DAY / 2:
            near, periods = {"midnight passes"}, {"midnight passes": DAY}
        for what in near:
            self.again.setdefault(what, []).append(row)
            return periods[what]
        if self.settings.repair != "shift" or (ahead is None and step == 0):
            return 0.0
        if ahead is not None:
            sides = [np.nanmedian(side) for side in (ahead[0][-_BESIDE:], ahead[1][:_BESIDE]) if side.size]
            added = float(sides[1] - sides[0]) if len(sides) > 1 else np.nan
        else:
            added = (self.settings.gap or np.nan) - step
        if not added + step > 0:
            raise self._not_told(before, before + step, row, None if ahead is None else added + step)
        self.back.append(row)
        self.largest = max(self.largest, -step)
        self.stood.append(added + step)
        return added

    def _not_told(self, before: float, now: float, row: int, stood: float | None) -> InputError:
        """The error of a clock that was set back, where how long it stood is not known."""
        what = f"the time goes from {before:.9g} s back to {now:.9g} s"
        if stood is not None:
            why = f"and the clock of {self.label}.host does not go on there ({stood:.3g} s). Name another column"
        else:
            why = (
                f"and how long the clock stood is not known. Write under {self.label} host: COLUMN, a clock that went "
                "on, or gap: TIME, from the last sample before to the first one after, as in gap: 0.28 s"
            )
        return InputError(f"{what}, {why}.", file=self.file, line=row, field=self.column.name)

    def found(self) -> list[str]:
        """What was found out of the clock, in sentences."""
        notes = [note for note in (self.assumed_column, self.assumed) if note]
        if self.nanoseconds is not None:
            notes.append(f"{self.label}: {self.column.name} and the nanoseconds beside it")
        if self.start:
            rounded = f", rounded to {self.rounded:.1g} s" if self.rounded > 1e-9 else ""
            notes.append(f"{self.label}: seconds since {self.start}{rounded}")
        if self.settings.offset:
            notes.append(f"{self.label}: {self.settings.offset:g} s added, by the sheet")
        return notes

    def repairs(self) -> list[str]:
        """What was mended, in sentences with rows."""
        notes = [
            f"{self.label}: {what} before {_rows(rows)}: counted on from there" for what, rows in self.again.items()
        ]
        if self.back:
            how = f"up to {self.largest:.6g} s" if len(self.back) > 1 else f"{self.largest:.6g} s"
            stood = ", ".join(f"{x:.3g}" for x in self.stood[:3]) + (" s" if len(self.stood) <= 3 else " s and so on")
            by = f"the clock of {self.host.column.name}" if self.host is not None else "the sheet"
            notes.append(f"{self.label}: goes back by {how} before {_rows(self.back)}: it stood {stood} by {by}")
        return notes

    def oddities(self, first: float, last: float, usual: float) -> list[str]:
        """Sizes of the time that are improbable, in sentences."""
        remedy = f"If that is wrong, write {self._in_milliseconds()}, or its unit, in a sheet"
        if max(abs(first), abs(last)) > 3.2e9:
            return [f"{self.label}: {max(first, last, key=abs):.3g} s is more than 100 years. {remedy}"]
        if usual > 3600 or (self.assumed and usual >= 2) or usual < 1e-8:
            taken = f"{self.column.name} is taken in {self.unit}: a sample" if self.assumed else "a sample"
            return [f"{self.label}: {taken} every {usual:.4g} s. {remedy}"]
        return []


def _rows(rows: list[int]) -> str:
    shown = f"row{'s' * (len(rows) > 1)} {', '.join(map(str, rows[:3]))}"
    return shown if len(rows) <= 3 else f"{shown} and {len(rows) - 3} more"

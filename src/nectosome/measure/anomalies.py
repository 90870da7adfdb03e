"""Anomalies of recorded data, found piece by piece: times out of order, gaps, missing and saturated values."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError

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
            remedy += ", or repair: shift, which counts on where a clock was set back"
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

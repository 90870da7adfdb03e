"""What is odd about numbers as they come, piece by piece: times that do not go on, gaps, missing, saturated values."""

from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError

from .sheet import Repair

_GAP = 5.0  # usual intervals
_STUCK = 10  # samples in a row at the largest or smallest value that look saturated


@dataclass
class TimeWatch:
    """Sees that times go on, and keeps account of intervals."""

    file: str
    column: str
    repair: Repair = "refuse"
    count: int = 0
    first: float = np.nan
    last: float = np.nan
    usual: float = np.nan  # interval, median of the first piece [s]
    shortest: float = np.inf
    longest: float = 0.0
    dropped: list[int] = field(default_factory=list)  # rows
    gaps: list[tuple[float, float, int]] = field(default_factory=list)  # from, to [s], row after it

    def keep(self, rows: Int[np.ndarray, "n"], time: Float[np.ndarray, "n"]) -> Bool[np.ndarray, "n"]:
        """Which rows go on in time. Raises InputError for the first that does not, unless such rows are dropped."""
        before = -np.inf if self.count == 0 else self.last
        fine = np.isfinite(time)
        highest = np.maximum.accumulate(np.where(fine, time, -np.inf))
        fine &= time > np.maximum(before, np.concatenate([[-np.inf], highest[:-1]]))
        if not fine.all():
            if self.repair == "refuse":
                raise self._refusal(int(np.argmin(fine)), rows, time, before)
            self.dropped += rows[~fine].tolist()
        self._account(rows[fine], time[fine])
        return fine

    def _refusal(self, k: int, rows: np.ndarray, time: np.ndarray, before: float) -> InputError:
        previous = time[k - 1] if k else before
        if not np.isfinite(time[k]):
            what = "the time is missing" if np.isnan(time[k]) else "the time is infinite"
        elif time[k] == previous:
            what = f"the time {time[k]:.9g} s stands there twice"
        else:
            what = f"the time {time[k]:.9g} s comes after {previous:.9g} s"
        way = "Correct the file, or write repair: drop under time in a sheet to leave such rows out."
        return InputError(f"{what}. {way}", file=self.file, line=int(rows[k]), field=self.column)

    def _account(self, rows: np.ndarray, time: np.ndarray) -> None:
        if not time.size:
            return
        joined = time if self.count == 0 else np.concatenate([[self.last], time])
        after = rows[1:] if self.count == 0 else rows
        steps = np.diff(joined)
        if np.isnan(self.usual) and steps.size:
            self.usual = float(np.median(steps))
        if steps.size:
            self.shortest, self.longest = min(self.shortest, steps.min()), max(self.longest, steps.max())
            for k in np.flatnonzero(steps > _GAP * self.usual):
                self.gaps.append((float(joined[k]), float(joined[k + 1]), int(after[k])))
        if self.count == 0:
            self.first = float(time[0])
        self.last, self.count = float(time[-1]), self.count + time.size

    @property
    def even(self) -> bool:
        """Whether all intervals are the same to 1 in 1000."""
        return self.count > 2 and self.longest - self.shortest <= 1e-3 * self.usual


@dataclass
class ValueWatch:
    """Keeps account of one quantity: how many are missing or saturated, the smallest, largest and mean."""

    name: str
    count: int = 0
    total: float = 0.0
    smallest: float = np.inf
    largest: float = -np.inf
    missing: list[int] = field(default_factory=list)  # first rows of it
    missing_count: int = 0
    saturated_count: int = 0
    saturated: int | None = None  # first row
    stuck: dict[float, tuple[int, int]] = field(default_factory=dict)  # longest row of samples at an extreme, its row

    def look(
        self, rows: Int[np.ndarray, "n"], cells: Float[np.ndarray, "n"], low: float, high: float
    ) -> Float[np.ndarray, "n"]:
        """Cells without what is saturated or infinite, nan in its place; all of it is counted."""
        lost = ~np.isfinite(cells) | (cells <= low) | (cells >= high)
        there = cells
        if lost.any():
            there, missing = cells[~lost], np.isnan(cells)
            self.missing_count += int(missing.sum())
            self.missing += rows[missing][: max(0, 5 - len(self.missing))].tolist()
            over = lost & ~missing
            if over.any():
                self.saturated_count += int(over.sum())
                self.saturated = int(rows[np.argmax(over)]) if self.saturated is None else self.saturated
                cells = np.where(over, np.nan, cells)
        if there.size:
            self.count, self.total = self.count + there.size, self.total + float(there.sum())
            ends = float(there.min()), float(there.max())
            self.smallest, self.largest = min(self.smallest, ends[0]), max(self.largest, ends[1])
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
        """Mean of what is there."""
        return self.total / self.count if self.count else np.nan

    def clipped(self) -> list[tuple[float, int, int]]:
        """Extremes [cells] at which the reading stood still, for how many samples, from which row."""
        if self.smallest == self.largest:
            return []
        ends = {self.smallest, self.largest}
        return [(value, n, row) for value, (n, row) in self.stuck.items() if value in ends]

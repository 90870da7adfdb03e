"""Readings that start again: counters of 16 to 32 bits, signed numbers read as unsigned ones, encoders, directions.

A reading that starts again after the period P makes a step of almost P where the quantity made a small one. All steps
of such a column are below P/4 or above 3/4 P; P is taken off or added at each of the latter. Steps over lost samples
tell nothing of that: in a gap it may have started again any number of times.
"""

import numpy as np
from jaxtyping import Bool, Float

from nectosome.units import count, scale_to_si

_BITS = {2.0**16: "16 bits", 2.0**24: "24 bits", 2.0**32: "32 bits"}
_ENCODERS = 2.0**10, 2.0**12, 2.0**14  # counts of a turn
_TURNS = 360.0, 2 * np.pi  # directions in a column without a unit
_ROUNDED = 1e-3  # [period] by which readings that are no counts may be beyond an end, as -3.1416 is
_ENDS = 0.05  # [period] from both ends of its range that an encoder's or a direction's readings must reach
_HIGH = 7 / 8  # [period] above which all readings may be negative ones
_LOST = 1.5  # [usual interval] from which on samples are lost
_USUAL = 1 / 8  # [range] below which all steps of readings with an unknown period are, but those where they start again
_SMOOTH = 4.0  # [largest usual step], the least range of such readings once they go on
_CONVERTERS = range(8, 33)  # bits
_EVENLY = 1 / 16  # [period] below which steps change from one to the next, of readings that go by more than a quarter
_MOSTLY = 0.98  # share of the steps that do
_ENOUGH = 20  # of them
_SHOWN = 20  # jumps of a piece that are looked at


class Wrap:
    """One period after which a column's readings may start again; it sees all of them, piece by piece."""

    def __init__(self, period: float, is_bare: bool = False, is_signed: bool | None = None):
        self.period, self.is_bare = period, is_bare  # of readings without a unit
        self.is_signed = period in _BITS if is_signed is None else is_signed  # readings may be those of a signed number
        self.possible = True
        self.least, self.most = np.inf, -np.inf  # of the cells
        self.low, self.high = np.inf, -np.inf  # of the cells without starts
        self.times = 0  # it started again
        self._last, self._turns = np.nan, 0.0
        self._inner = 0  # cells that are neither the first nor the last of their range
        self._at, self._fastest = np.nan, 0.0  # sample of the last one; largest usual step
        self._elsewhere, self._at_starts = 0.0, 0.0  # largest steps: where it does not start again, and where it does
        self._in_range, self._far = True, 0  # steps that are neither usual nor such ones
        self._even = self._changes = 0  # changes of steps below _EVENLY, and all of them
        self._gaps: list[float] = []  # [usual interval]

    def take(self, cells: Float[np.ndarray, "n"], at: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Consecutive cells as if they had gone on where they started again; the first one of all stays.

        `at` are their times over the usual interval.
        """
        there = np.isfinite(cells)
        known = cells[there]
        if not self._in_range or not known.size:
            return cells
        self.least, self.most = min(self.least, float(known.min())), max(self.most, float(known.max()))
        half, is_count = self.period / 2, self.period in (*_BITS, *_ENCODERS)
        beyond = 0.0 if is_count else _ROUNDED * self.period
        low, high = (0.0, self.period) if self.least >= -beyond else (-half, half)
        below = self.most < high if is_count and not low else self.most <= high + beyond
        self._in_range = bool(low - beyond <= self.least and below)
        if is_count:
            self._in_range &= bool(np.all(known == np.floor(known)))
        steps = np.diff(known, prepend=self._last if np.isfinite(self._last) else known[:1])
        size = np.abs(steps)
        joined, intervals = _joined(at[there], self._at)
        far = (size > self.period / 4) & (size < 3 / 4 * self.period) & joined
        self._far += int(np.count_nonzero(far))
        change = np.abs((np.diff(steps) + half) % self.period - half)[joined[1:] & joined[:-1]]
        self._changes += change.size
        self._even += int(np.count_nonzero(change < _EVENLY * self.period))
        self._inner += int(np.count_nonzero((known > self.least) & (known < self.most)))
        self.possible = self._in_range and not self._far
        if not self.possible:
            self._last = float(known[-1])
            return cells
        self._at = float(at[there][-1])
        self._gaps += intervals[~joined].tolist()
        self._fastest = max(self._fastest, float(np.minimum(size, self.period - size)[joined].max(initial=0.0)))
        self._elsewhere = max(self._elsewhere, float(size[joined & (size < half)].max(initial=0.0)))
        self._at_starts = max(
            self._at_starts, float(np.abs(self.period - size)[joined & (size > half)].max(initial=0.0))
        )
        turns = np.where(size > half, -np.sign(steps), 0.0)
        self.times += int(np.count_nonzero(turns))
        turns = self._turns + np.cumsum(turns)
        self._last, self._turns = float(known[-1]), float(turns[-1])
        known = known + self.period * turns
        self.low, self.high = min(self.low, float(known.min())), max(self.high, float(known.max()))
        whole = cells.copy()
        whole[there] = known
        return whole

    @property
    def is_asked(self) -> bool:
        """Whether a sheet has to say that readings start again: any may have the range of an encoder or of a turn."""
        return self.period in _ENCODERS or (self.is_bare and self.period in _TURNS)

    @property
    def happened(self) -> bool:
        """Whether the readings started again for certain; two values only, as of a trigger, do not tell it."""
        if not self.possible or not self._inner:
            return False
        if self.period in _BITS:
            return self.times > 0 or (self.period == 2.0**32 and self.least >= self.period / 2)
        other = self.is_asked and self._at_starts > 2 * self._elsewhere + 1  # it has another period
        return self.times > 0 and self._reaches and not other

    @property
    def _reaches(self) -> bool:
        """Whether readings are almost at both ends of their range."""
        lower = 0.0 if self.least >= -_ROUNDED * self.period else -self.period / 2
        return self.least - lower < _ENDS * self.period and lower + self.period - self.most < _ENDS * self.period

    @property
    def _is_too_fast(self) -> bool:
        """Whether readings go on evenly by more than a quarter of their period, so that its turns are not known."""
        far = self._in_range and self._reaches and self._inner > 0 and self._far > 0
        return far and self._even >= max(_MOSTLY * self._changes, _ENOUGH)

    @property
    def shift(self) -> float:
        """What brings the readings of a signed number into its range, where they fit; else 0."""
        if self.least < 0 or not self.is_signed:
            return 0.0
        shift = -self.period * np.floor(self.low / self.period + 0.5)
        return float(shift) if self._fits(shift) else 0.0

    def _fits(self, shift: float) -> bool:
        """Whether all counts, shifted, are within the range of a signed number."""
        return self.low + shift >= -self.period / 2 and self.high + shift < self.period / 2

    def doubt(self) -> str:
        """What may be wrong with the readings, in words; "" where nothing may."""
        how = f"If so, write wrap: {self.period:.8g} beside the column in a sheet"
        if self.is_asked and self.happened:
            return f"jumps {self.times} times between {self.least:g} and {self.most:g}: does it start again? {how}"
        if self._is_too_fast:
            what = f"goes by more than a quarter of {self.period:g} between samples, {self._far} times"
            return (
                f"{what}: does it start again, once or more from one to the next? How often is not known. Sample faster"
            )
        if self.period == 2.0**16 and self.possible and self._inner and self.least > _HIGH * self.period:
            return f"is from {self.least:g} to {self.most:g}: negative numbers read as unsigned ones? {how}"
        return ""

    def unknown_turns(self) -> str:
        """Gaps in which readings may have started again, in words; "" where there are none."""
        n = sum(interval * self._fastest > self.period / 2 for interval in self._gaps)
        what = f"{count(n, 'gap')} in which it may have started again, as fast as it was"
        return f"{what}: from there on it may be wrong by multiples of {self.period:.8g}" if n else ""

    def told(self, shift: float) -> str:
        """What was mended, in words."""
        if self.period in _BITS and self.least >= 0 and self._fits(shift):
            return f"negative numbers of {_BITS[self.period]}, read as unsigned ones, are negative again"
        what = f"a counter of {_BITS[self.period]}" if self.period in _BITS else f"readings of period {self.period:g}"
        return f"{what} that start{'s' * (self.period in _BITS)} again, {self.times} times: counted on from there"


class Jumps:
    """Steps over the range of readings that are small otherwise: those of a counter that was scaled, of any period."""

    def __init__(self) -> None:
        self.least, self.most = np.inf, -np.inf
        self._last = self._at = np.nan
        self._whole = True  # all cells are whole numbers
        self._finest, self._extent = np.inf, 0.0  # smallest step; range of a piece once it goes on
        self._pieces: list[tuple[float, float, int, np.ndarray]] = []

    def look_at(self, cells: Float[np.ndarray, "n"], at: Float[np.ndarray, "n"]) -> None:
        """Look at consecutive cells; `at` are their times over the usual interval."""
        there = np.isfinite(cells)
        known = cells[there]
        if not known.size:
            return
        self._whole &= bool(np.all(known == np.floor(known)))
        joined, _ = _joined(at[there], self._at)
        before = np.concatenate([[self._last if np.isfinite(self._last) else known[0]], known[:-1]])
        self._last, self._at = float(known[-1]), float(at[there][-1])
        ends = float(known.min()), float(known.max())
        self.least, self.most = min(self.least, ends[0]), max(self.most, ends[1])
        steps = known - before
        size = np.abs(steps)
        large = joined & (size > (self.most - self.least) / 2)
        usual = np.where(joined & ~large, steps, 0.0)
        middle = (ends[0] + ends[1]) / 2
        self._finest = min(self._finest, float(np.abs(usual[usual != 0]).min(initial=np.inf)))
        above, below = known[known > middle].min(initial=ends[1]), known[known <= middle].max(initial=ends[0])
        self._extent = max(self._extent, float(below - ends[0] + ends[1] - above))
        k = np.flatnonzero(large)[:_SHOWN]
        beside = (usual[np.maximum(k - 1, 0)] + usual[np.minimum(k + 1, steps.size - 1)]) / 2
        jumps = np.stack([before[k], known[k], size[k] - np.sign(steps[k]) * beside], axis=1)
        smallest, n = float(size[large].min(initial=np.inf)), int(np.count_nonzero(large))
        self._pieces.append((smallest, float(np.abs(usual).max()), n, jumps))

    @property
    def happened(self) -> bool:
        """Whether it is likely that readings started again: from one end to the other, and smooth once they go on."""
        jumps, usual, _ = self._all()
        if not len(jumps) or not 0 < usual < min(_USUAL * (self.most - self.least), self._extent / _SMOOTH):
            return False
        low, high = np.sort(jumps[:, :2], axis=1).T
        return bool((low - self.least <= 2 * usual).all() and (self.most - high <= 2 * usual).all())

    def _all(self) -> tuple[np.ndarray, float, int]:
        """Cells before and after jumps and the periods by these, the largest usual step, the number of jumps."""
        large = [piece for piece in self._pieces if piece[0] > (self.most - self.least) / 2]
        usual = max((piece[1] for piece in self._pieces), default=0.0)
        if not large or len(large) < len(self._pieces):  # the latter are large for the range then
            return np.zeros((0, 3)), usual, 0
        return np.concatenate([piece[3] for piece in large]), usual, sum(piece[2] for piece in large)

    def doubt(self) -> str:
        """What may be wrong with the readings, in words; "" where nothing may."""
        if not self.happened:
            return ""
        jumps, usual, n = self._all()
        finest = 1.0 if self._whole else self._finest
        period, counts = float(np.median(jumps[:, 2])), np.abs(jumps[:, 1] - jumps[:, 0]) / finest
        if np.abs(counts - np.round(counts)).max() < 0.02:  # the finest step is that of a converter
            exact = [finest * 2.0**bits for bits in _CONVERTERS]
            near = finest + float(np.ptp(jumps[:, 2])) if n > 1 else 2 * usual
            known = float(np.round(period)) if self._whole else period
            period = next((x for x in exact if abs(x - period) <= min(near, 2 * usual)), known)
        times = f"{n} times" if n > 1 else "once"
        what = f"jumps {times} between {self.least:g} and {self.most:g}, and else by {usual:.3g} at most"
        how = f"write wrap: {period:.8g} beside the column in a sheet, as exactly as you know it"
        return f"{what}: does it start again, or are negative numbers read as unsigned ones? If so, {how}"


def _joined(at: Float[np.ndarray, "n"], last: float) -> tuple[Bool[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Whether no sample is lost before each one, and the intervals before them; `last` is the one before the first."""
    intervals = np.diff(at, prepend=last if np.isfinite(last) else at[0])
    return intervals <= _LOST, intervals


def wraps_of(unit: str) -> list[Wrap]:
    """What may have happened to readings in this unit: numbers of 16 to 32 bits, encoders, directions."""
    try:
        factor, _, si = scale_to_si(unit)
    except ValueError:
        return [Wrap(period) for period in (*_BITS, *_ENCODERS)]  # counts
    turns = _TURNS if not si else (2 * np.pi / factor,) if si == "rad" else ()
    others = _ENCODERS if si in ("", "count") else ()
    return [Wrap(period, not si) for period in (*_BITS, *others, *turns)]


def wrap_by_sheet(period: float, unit: str) -> Wrap:
    """The wrap of a period that a sheet names: of signed numbers, unless it is a whole turn of an angle."""
    turns = [wrap.period for wrap in wraps_of(unit) if wrap.period not in _BITS]
    return Wrap(period, is_signed=not np.isclose(period, turns, rtol=1e-6).any())

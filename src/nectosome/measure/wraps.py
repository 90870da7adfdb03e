"""Readings that start again: counters of 16 and 32 bits, signed numbers read as unsigned ones, encoders, directions.

A reading that starts again after the period P makes a step of almost P where the quantity made a small one. All steps
of such a column are below P/4 or above 3/4 P; P is taken off or added at each of the latter.
"""

import numpy as np
from jaxtyping import Float

from nectosome.units import scale_to_si

_BITS = {2.0**16: "16 bits", 2.0**32: "32 bits"}
_ENCODERS = 2.0**10, 2.0**12, 2.0**14  # counts of a turn
_TURNS = 360.0, 2 * np.pi  # directions in a column without a unit
_ROUNDED = 1e-3  # [period] by which readings that are no counts may be beyond an end, as -3.1416 is
_ENDS = 0.05  # [period] from both ends of its range that an encoder's or a direction's readings must reach
_HIGH = 7 / 8  # [period] above which all readings may be negative ones


class Wrap:
    """One period after which a column's readings may start again; it sees all of them, piece by piece."""

    def __init__(self, period: float, is_bare: bool = False):
        self.period, self.is_bare = period, is_bare  # of readings without a unit
        self.possible = True
        self.least, self.most = np.inf, -np.inf  # of the cells
        self.low, self.high = np.inf, -np.inf  # of the cells without starts
        self.times = 0  # it started again
        self._last, self._turns = np.nan, 0.0
        self._inner = 0  # cells that are neither the first nor the last of their range

    def take(self, cells: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Consecutive cells as if they had gone on where they started again; the first one of all stays."""
        there = np.isfinite(cells)
        known = cells[there]
        if not self.possible or not known.size:
            return cells
        self.least, self.most = min(self.least, float(known.min())), max(self.most, float(known.max()))
        half, is_count = self.period / 2, self.period in (*_BITS, *_ENCODERS)
        beyond = 0.0 if is_count else _ROUNDED * self.period
        low, high = (0.0, self.period) if self.least >= -beyond else (-half, half)
        below = self.most < high if is_count and not low else self.most <= high + beyond
        self.possible = low - beyond <= self.least and below
        if is_count:
            self.possible &= bool(np.all(known == np.floor(known)))
        steps = np.diff(known, prepend=self._last if np.isfinite(self._last) else known[:1])
        size = np.abs(steps)
        self.possible &= not ((size > self.period / 4) & (size < 3 / 4 * self.period)).any()
        if not self.possible:
            return cells
        turns = np.where(size > half, -np.sign(steps), 0.0)
        self.times += int(np.count_nonzero(turns))
        turns = self._turns + np.cumsum(turns)
        self._last, self._turns = float(known[-1]), float(turns[-1])
        self._inner += int(np.count_nonzero((known > self.least) & (known < self.most)))
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
        lower = 0.0 if self.least >= -_ROUNDED * self.period else -self.period / 2
        reached = self.least - lower < _ENDS * self.period and lower + self.period - self.most < _ENDS * self.period
        return self.times > 0 and reached

    @property
    def shift(self) -> float:
        """What brings the counts of a number of bits into the range of a signed one, where they fit; else 0."""
        if self.least < 0 or self.period not in _BITS:
            return 0.0
        shift = -self.period * np.floor(self.low / self.period + 0.5)
        return float(shift) if self._is_signed(shift) else 0.0

    def _is_signed(self, shift: float) -> bool:
        """Whether all counts, shifted, are within the range of a signed number."""
        return self.low + shift >= -self.period / 2 and self.high + shift < self.period / 2

    def doubt(self) -> str:
        """What may be wrong with the readings, in words; "" where nothing may."""
        how = f"If so, write wrap: {self.period:.8g} beside the column in a sheet"
        if self.is_asked and self.happened:
            return f"jumps {self.times} times between {self.least:g} and {self.most:g}: does it start again? {how}"
        if self.period == 2.0**16 and self.possible and self._inner and self.least > _HIGH * self.period:
            return f"is from {self.least:g} to {self.most:g}: negative numbers read as unsigned ones? {how}"
        return ""

    def told(self, shift: float) -> str:
        """What was mended, in words."""
        if self.period in _BITS and self.least >= 0 and self._is_signed(shift):
            return f"negative numbers of {_BITS[self.period]}, read as unsigned ones, are negative again"
        what = f"a counter of {_BITS[self.period]}" if self.period in _BITS else f"readings of period {self.period:g}"
        return f"{what} that start{'s' * (self.period in _BITS)} again, {self.times} times: counted on from there"


def wraps_of(unit: str) -> list[Wrap]:
    """What may have happened to readings in this unit: numbers of 16 and 32 bits, encoders, directions."""
    try:
        factor, _, si = scale_to_si(unit)
    except ValueError:
        return [Wrap(period) for period in (*_BITS, *_ENCODERS)]  # counts
    turns = _TURNS if not si else (2 * np.pi / factor,) if si == "rad" else ()
    others = _ENCODERS if si in ("", "count") else ()
    return [Wrap(period, not si) for period in (*_BITS, *others, *turns)]

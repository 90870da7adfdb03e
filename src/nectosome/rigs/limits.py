"""Limits of commands and measurements of a rig, beyond which an experiment is stopped."""

import math
from dataclasses import dataclass, fields

from nectosome.units import InputError


@dataclass(frozen=True)
class Limits:
    """Limits of commands and measurements, in the units of the rig. All of them are watched, always.

    Commands beyond range or rate are cut down to them; anything else that is beyond its limit ends the experiment.
    Time above the limit of the error counts, and time below it counts back at half the rate, so that a loop that
    oscillates is stopped too: with an amplitude of 1.2 times the limit or more. The same holds for time at an end of
    the range or at the largest rate: a loop whose gains are far too high oscillates there, maybe with a small error.
    """

    low: float  # of commands; 0 is within
    high: float
    slew: float  # of commands [1/s]
    least: float  # of measurements
    most: float
    error: float  # of |reference - measured|
    error_time: float = 0.5  # above it [s]
    saturated_time: float = 2.0  # with the command at an end of its range, or at its largest rate [s]
    frozen_time: float = 0.25  # with the same reading, to the last bit, [s]
    frozen_share: float = 0.1  # while the command moves by this share of its range
    overrun: float = 0.5  # share of dt by which a sample may be late
    overruns_in_row: int = 10  # samples that are later
    overruns_share: float = 0.05  # of all samples, that are later

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if not math.isfinite(value):
                raise InputError(f"{value:g} is no limit; a finite number expected.", field=field.name)
            if field.name not in ("low", "high", "least", "most") and value <= 0:
                raise InputError(f"{value:g} is no limit; a number above 0 expected.", field=field.name)
        if not self.low <= 0 <= self.high or self.low == self.high:
            raise InputError(f"commands from {self.low:g} to {self.high:g}: 0 must be within.", field="low")
        if not self.least < self.most:
            raise InputError(f"measurements from {self.least:g} to {self.most:g} leave no room.", field="least")


class Timer:
    """Time in which something is so; time in which it is not counts back at half the rate."""

    def __init__(self, dt: float):
        self._dt = dt
        self.time = 0.0

    def count(self, so: bool) -> float:
        """The time after one more sample."""
        self.time = self.time + self._dt if so else max(self.time - 0.5 * self._dt, 0.0)
        return self.time


class Frozen:
    """A reading that stays the same to the last bit while the command moves."""

    def __init__(self, dt: float):
        self._dt = dt
        self._reading = math.nan
        self.time = 0.0
        self._low = self._high = 0.0

    @property
    def moved(self) -> float:
        """By how much the command moved in that time."""
        return self._high - self._low

    def count(self, reading: float, command: float) -> None:
        """One more sample."""
        if reading != self._reading:
            self._reading, self.time, self._low, self._high = reading, 0.0, command, command
        else:
            self.time += self._dt
            self._low, self._high = min(self._low, command), max(self._high, command)


class Overruns:
    """Samples that come too late."""

    def __init__(self):
        self.total = self.in_row = 0
        self.latest = 0.0  # [s]

    def count(self, late: float, limit: float) -> None:
        """One more sample."""
        self.latest = max(self.latest, late)
        self.in_row = self.in_row + 1 if late > limit else 0
        self.total += late > limit


def slewed(wanted: float, before: float, most: float) -> float:
    """The command nearest to the wanted one, no further than `most` from the one before."""
    return min(max(wanted, before - most), before + most)

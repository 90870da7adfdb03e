"""Limits of commands and measurements of a rig, and guards that hold a controller to them at every sample."""

import math
from dataclasses import dataclass, fields

from nectosome.units import InputError

from .rig import Rig


@dataclass(frozen=True)
class Limits:
    """Limits of commands and measurements, in the units of the rig. All of them are always checked.

    Commands are limited to range and rate; anything else that is beyond its limit ends the experiment.
    Time above the limit of the error counts, and time below it counts back at half the rate, so that a loop that
    oscillates is stopped too: with an amplitude of 1.2 times the limit or more. The same holds for time at an end of
    the range or at the largest rate: a loop whose gains are far too high oscillates there, maybe with a small error.
    """

    low: float
    """Smallest command; 0 is within low and high."""
    high: float
    """Largest command."""
    slew: float  # [1/s]
    """Largest change of the command per second."""
    least: float
    """Smallest measurement."""
    most: float
    """Largest measurement."""
    error: float
    """Largest difference of reference and measurement."""
    error_time: float = 0.5  # [s]
    """Time above the limit of the error after which the experiment ends."""
    saturated_time: float = 2.0  # [s]
    """Time with the command at an end of its range, or at its largest rate, after which the experiment ends."""
    frozen_time: float = 0.25  # [s]
    """Time with the same reading, to the last bit, after which the experiment ends."""
    frozen_share: float = 0.1
    """Share of its range by which the command has to move in that time, for the reading to count as frozen."""
    overrun: float = 0.5
    """Share of dt by which a sample may be late."""
    overruns_in_row: int = 10
    """Number of samples in a row that are later, at which the experiment ends."""
    overruns_share: float = 0.05
    """Share of all samples that are later, at which the experiment ends."""

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


class Guards:
    """The limits of one run of `count` samples, `dt` [s] apart."""

    def __init__(self, limits: Limits, rig: Rig, dt: float, count: int):
        self.limits, self.dt = limits, dt
        self._rig, self._count = rig, count
        self._error, self._saturated = Timer(dt), Timer(dt)
        self._frozen = Frozen(dt)
        self._overruns = Overruns()
        self._clamped = self._slowed = 0
        self._at_limit = False  # the last command, by its range or its rate

    def allowed(self, unlimited: float, before: float, elapsed: float) -> float:
        """The admissible command nearest to an unlimited one, `elapsed` [s] after the one before.

        No more than dt counts, so that a pause is not made up for by a jump.
        """
        limits = self.limits
        within = min(max(unlimited, limits.low), limits.high)
        most = limits.slew * min(max(elapsed, 0.0), self.dt)
        command = slewed(within, before, most)
        self._clamped += within != unlimited
        self._slowed += abs(command - within) > 1e-9 * (limits.high - limits.low)
        at_end = command != 0 and command in (limits.low, limits.high)  # at 0 it rests, wherever that is
        self._at_limit = at_end or abs(command - before) > 0.999 * most > 0
        return command

    def sample(self, late: float, reference: float, measured: float, command: float) -> str:
        """Why a sample ends the experiment, in a sentence, or ""; `command` is what the rig was given before it."""
        self._overruns.count(late, self.limits.overrun * self.dt)
        if math.isfinite(measured):
            self._error.count(abs(reference - measured) > self.limits.error)
            self._frozen.count(measured, command)
        self._saturated.count(self._at_limit)
        return self._clock(late) or self._measurement(measured) or self._loop(reference, measured, command)

    def not_finite(self, command: float) -> str:
        """Why a command of the controller ends the experiment, or ""."""
        if math.isfinite(command):
            return ""
        return (
            f"the controller's command is {command:g} {self._rig.command_unit}. "
            "Look at its numbers, and at the last measurements."
        )

    def counts(self) -> dict[str, float]:
        """Samples whose command was out of its range, or too fast, samples that were late, and the largest delay."""
        total, latest = self._overruns.total, self._overruns.latest
        return {"clamped": self._clamped, "slowed": self._slowed, "overruns": total, "latest": latest}

    def _clock(self, late: float) -> str:
        limits, overruns = self.limits, self._overruns
        if not late >= -limits.overrun * self.dt:  # nor where it is NaN
            return (
                f"the sample comes {-late:.3g} s too early. "
                "Look at the rig's clock: it went back, or does not wait as long as it should."
            )
        hint = "Look at what else runs on this machine, at the time that the rig takes to answer, or take a longer dt."
        if overruns.in_row >= limits.overruns_in_row:
            return (
                f"{overruns.in_row} samples in a row are late by more than {limits.overrun:g} of dt "
                f"({self.dt:g} s), this one by {late:.3g} s. {hint}"
            )
        if overruns.total > max(limits.overruns_share * self._count, limits.overruns_in_row):
            return (
                f"{overruns.total} samples are late by more than {limits.overrun:g} of dt ({self.dt:g} s), at most "
                f"{limits.overruns_share:.3g} of {self._count} are allowed. {hint}"
            )
        return ""

    def _measurement(self, measured: float) -> str:
        limits, unit = self.limits, self._rig.measured_unit
        if not math.isfinite(measured):
            return (
                f"the measurement is {measured:g} {unit}. "
                "Look whether the sensor sees its target, and is within its range."
            )
        if not limits.least <= measured <= limits.most:
            return (
                f"the measurement is {measured:g} {unit}, {limits.least:g} to {limits.most:g} {unit} are allowed. "
                "Look at the sensor's zero, at the sign of the command, and at the controller's gains."
            )
        return ""

    def _loop(self, reference: float, measured: float, command: float) -> str:
        limits, rig = self.limits, self._rig
        if self._frozen.time >= limits.frozen_time and self._frozen.moved > limits.frozen_share * (
            limits.high - limits.low
        ):
            return (
                f"the measurement stays {measured:g} {rig.measured_unit} to the last bit for {self._frozen.time:.3g} s "
                f"while the command moves by {self._frozen.moved:g} {rig.command_unit}, "
                f"{limits.frozen_time:g} s are allowed. Look whether the sensor still measures, and whether "
                "anything moves: power, supply, a blocked part."
            )
        if self._error.time > limits.error_time:
            return (
                f"the error is {reference - measured:g} {rig.measured_unit} and was above {limits.error:g} "
                f"{rig.measured_unit} for {self._error.time:.3g} s, {limits.error_time:g} s are allowed. Look "
                "at the log: a loop that oscillates has too high gains, one that lags has too low ones, or a "
                "valve that does not open."
            )
        if self._saturated.time > limits.saturated_time:
            return (
                f"the command is at an end of its range ({limits.low:g} to {limits.high:g} {rig.command_unit}), or "
                f"changes as fast as is allowed ({limits.slew:g} {rig.command_unit}/s), for "
                f"{self._saturated.time:.3g} s, {limits.saturated_time:g} s are allowed. Look at the log: the loop "
                "oscillates, its gains are too high; or the rig cannot reach the reference, or its valve is shut."
            )
        return ""


@dataclass
class Timer:
    """Time in which a condition holds; time in which it does not counts back at half the rate."""

    dt: float
    time: float = 0.0

    def count(self, holds: bool) -> float:
        """The time after one more sample."""
        self.time = self.time + self.dt if holds else max(self.time - 0.5 * self.dt, 0.0)
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


@dataclass
class Overruns:
    """Samples that come too late."""

    total: int = 0
    in_row: int = 0
    latest: float = 0.0  # [s]

    def count(self, late: float, limit: float) -> None:
        """One more sample."""
        self.latest = max(self.latest, late)
        self.in_row = self.in_row + 1 if late > limit else 0
        self.total += late > limit


def slewed(target: float, before: float, most: float) -> float:
    """The command nearest to a target, no further than `most` from the one before."""
    return min(max(target, before - most), before + most)

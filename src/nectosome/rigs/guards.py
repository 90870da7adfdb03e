"""Limits of commands and measurements of a rig, and guards that hold a controller to them at every sample."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any

from nectosome.description.fields import PositiveNumber, PositiveTime
from nectosome.units import InputError, did_you_mean, shorten, show_span, show_value

from .device_files import Count

NOTHING = "none"
"""What a measurement follows that no command moves."""


@dataclass(frozen=True)
class CommandLimits:
    """Limits of a command, in its unit, in a file in any of its kind: it is limited to a range and a rate."""

    low: float
    """Smallest command; 0 is within low and high."""
    high: float
    """Largest command."""
    slew: float  # [1/s]
    """Largest change of the command per second."""

    def __post_init__(self):
        _check_numbers(self, ("low", "high"))
        if not self.low <= 0 <= self.high or self.low == self.high:
            raise InputError(f"commands from {self.low:g} to {self.high:g}: 0 must be within.", field="low")


@dataclass(frozen=True)
class MeasurementLimits:
    """Limits of a measurement, in its unit, in a file in any of its kind: beyond one of them the experiment ends.

    Time above the limit of the error counts, and time below it counts back at half the rate, so that a loop that
    oscillates is stopped too: with an amplitude of 1.2 times the limit or more.
    """

    least: float
    """Smallest measurement."""
    most: float
    """Largest measurement."""
    error: float | None = None
    """Largest difference from its reference; needed where a controller makes it follow one. Else its reference is the
    command of the same name and unit, where there is one: so a servo that stalls is found."""
    error_time: PositiveTime = 0.5  # [s]
    """Time above the limit of the error after which the experiment ends."""
    follows: str | None = None
    """Command that moves it: while that moves, readings that stay the same are those of a frozen sensor. Left out, it
    is the command of the same name, or the only one; `none` for a sensor that no command moves, as a thermometer."""

    def __post_init__(self):
        _check_numbers(self, ("least", "most"))
        if not self.least < self.most:
            raise InputError(f"measurements from {self.least:g} to {self.most:g} leave no room.", field="least")


@dataclass(frozen=True)
class Limits:
    """Limits of commands and measurements, by their names. All of them are always checked.

    Every command has limits; a measurement without is recorded and not guarded. Time of a controller's command at an
    end of its range or at its largest rate counts as that of an error does: a loop whose gains are far too high
    oscillates there, maybe with a small error.
    """

    commands: Mapping[str, CommandLimits]
    """Those of every command."""
    measurements: Mapping[str, MeasurementLimits]
    """Those of measurements that are guarded."""
    saturated_time: PositiveTime = 2.0  # [s]
    """Time with a controller's command at an end of its range, or at its largest rate, after which the experiment
    ends."""
    frozen_time: PositiveTime = 0.25  # [s]
    """Time with the same reading, to the last bit, after which the experiment ends."""
    frozen_share: PositiveNumber = 0.1
    """Share of its range by which the command has to move in that time, for the reading to count as frozen."""
    overrun: PositiveNumber = 0.5
    """Share of dt by which a sample may be late."""
    overruns_in_row: Count = 10
    """Number of samples in a row that are later, at which the experiment ends."""
    overruns_share: PositiveNumber = 0.05
    """Share of all samples that are later, at which the experiment ends."""

    def __post_init__(self):
        _check_numbers(self)

    def check(self, commands: Collection[str], measurements: Collection[str]) -> None:
        """Raise InputError for a command of a rig without limits, and for names that it does not have."""
        for group, kind, known in (
            (self.commands, "command", commands),
            (self.measurements, "measurement", measurements),
        ):
            for name in group:
                if name not in known:
                    names = ", ".join(known) or "none"
                    raise InputError(
                        f"there is no {kind} of this name: {names}.{did_you_mean(name, known)}",
                        field=f"{kind}s.{shorten(name)}",
                    )
        for name in commands:
            if name not in self.commands:
                raise InputError("is missing: every command needs low, high and slew.", field=f"commands.{name}")
        for name, limits in self.measurements.items():
            if limits.follows not in (None, NOTHING, *commands):
                why = f'"{shorten(limits.follows)}" is no command of this rig: {", ".join(commands) or "none"}.'
                raise InputError(why, field=f"measurements.{name}.follows")

    def followed(self, name: str) -> str | None:
        """The command that a measurement follows; None where nothing says which."""
        given = self.measurements[name].follows
        if given == NOTHING:
            return None
        only = next(iter(self.commands)) if len(self.commands) == 1 else None
        return given or (name if name in self.commands else only)


def _check_numbers(limits: Any, any_sign: Sequence[str] = ()) -> None:
    """Raise InputError for a number that is not finite, or not above 0."""
    for field in fields(limits):
        value = getattr(limits, field.name)
        if not isinstance(value, float | int):
            continue
        if not math.isfinite(value):
            raise InputError(f"{value:g} is no limit; a finite number expected.", field=field.name)
        if field.name not in any_sign and value <= 0:
            raise InputError(f"{value:g} is no limit; a number above 0 expected.", field=field.name)


class Guards:
    """The limits of one run of `count` samples, dt [s] apart, of commands and measurements with their units.

    - references: measurements that a controller makes follow one.
    - controlled: commands that a controller computes; others may stay at the ends of their ranges.

    Raises InputError where limits do not fit the rig, and for a reference of a measurement without limits of its error.
    """

    def __init__(
        self,
        limits: Limits,
        commands: Mapping[str, str],
        measurements: Mapping[str, str],
        dt: float,
        count: int,
        references: Collection[str] = (),
        controlled: Collection[str] = (),
    ):
        limits.check(commands, measurements)
        self.limits, self.dt = limits, dt
        self._count, self._overruns = count, Overruns()
        self._commands = [
            _GuardedCommand(name, unit, limits, dt, name in controlled) for name, unit in commands.items()
        ]
        self._measured = list[tuple[int, _GuardedMeasurement]]()
        order = [*commands]
        for k, (name, unit) in enumerate(measurements.items()):
            if name in references and (name not in limits.measurements or limits.measurements[name].error is None):
                why = "is missing: a measurement that shall follow a reference needs least, most and error."
                raise InputError(why, field=f"measurements.{name}.error")
            if name in limits.measurements:
                follows = limits.followed(name)
                at = None if follows is None else order.index(follows)
                command = None if at is None else self._commands[at]
                self._measured.append((k, _GuardedMeasurement(name, unit, limits, dt, at, command)))

    def allowed(self, unlimited: Sequence[float], before: Sequence[float], elapsed: float) -> tuple[float, ...]:
        """The admissible commands nearest to unlimited ones, `elapsed` [s] after those before.

        No more than dt counts, so that a pause is not made up for by a jump.
        """
        step = min(max(elapsed, 0.0), self.dt)
        commands = zip(self._commands, unlimited, before, strict=True)
        return tuple(command.allowed(wanted, last, step) for command, wanted, last in commands)

    def sample(
        self, late: float, references: Mapping[str, float], measured: Sequence[float], commands: Sequence[float]
    ) -> str:
        """Why a sample ends the experiment, in a sentence, or ""; `commands` are those before it."""
        self._overruns.count(late, self.limits.overrun * self.dt)
        reasons = [self._clock(late)]
        reasons += [one.sample(measured[k], references.get(one.name), commands) for k, one in self._measured]
        reasons += [one.saturated() for one in self._commands]
        return next(filter(None, reasons), "")

    def not_finite(self, commands: Sequence[float]) -> str:
        """Why a command of the controller ends the experiment, or ""."""
        for guarded, command in zip(self._commands, commands, strict=True):
            if not math.isfinite(command):
                return (
                    f"the controller's command {guarded.name} is {command:g} {guarded.unit}. "
                    "Look at its numbers, and at the last measurements."
                )
        return ""

    def counts(self) -> dict[str, float]:
        """Samples with a command out of its range, or too fast, samples that were late, and the largest delay."""
        clamped, slowed = (sum(getattr(one, of) for one in self._commands) for of in ("clamped", "slowed"))
        return {
            "clamped": clamped, "slowed": slowed, "overruns": self._overruns.total, "latest": self._overruns.latest,
        }  # fmt: skip

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


class _GuardedCommand:
    """A command within its range and rate."""

    def __init__(self, name: str, unit: str, limits: Limits, dt: float, controlled: bool):
        self.name, self.unit, self.limits = name, unit, limits.commands[name]
        self.clamped = self.slowed = 0
        self._controlled = controlled
        self._most_time, self._time = limits.saturated_time, Timer(dt)
        self._at_limit = False  # the last one, by its range or its rate

    def allowed(self, unlimited: float, before: float, step: float) -> float:
        """The admissible command nearest to an unlimited one, a time `step` [s] after the one before."""
        limits = self.limits
        within = min(max(unlimited, limits.low), limits.high)
        most = limits.slew * step
        command = slewed(within, before, most)
        rounding = 1e-9 * (limits.high - limits.low)
        self.clamped += not abs(within - unlimited) <= rounding
        self.slowed += abs(command - within) > rounding
        at_end = command != 0 and command in (limits.low, limits.high)  # at 0 it rests, wherever that is
        self._at_limit = at_end or abs(command - before) > 0.999 * most > 0
        return command

    def saturated(self) -> str:
        """Count one more sample; why the command ends the experiment, or ""."""
        limits = self.limits
        if self._time.count(self._at_limit and self._controlled) <= self._most_time:
            return ""
        return (
            f"the command {self.name} is at an end of its range ({show_span(limits.low, limits.high, self.unit)}), or "
            f"changes as fast as is allowed ({show_value(limits.slew, self.unit, per='/s')}), for "
            f"{self._time.time:.3g} s, {self._most_time:g} s are allowed. Look at the log: the loop oscillates, its "
            "gains are too high; or the rig cannot reach the reference, or its valve is shut."
        )


class _GuardedMeasurement:
    """A measurement within its range, near its reference, that changes while the command that it follows does."""

    def __init__(
        self, name: str, unit: str, limits: Limits, dt: float, at: int | None, command: _GuardedCommand | None
    ):
        self.name = name
        self._unit, self._all, self._limits = unit, limits, limits.measurements[name]
        self._at, self._command = at, command  # which of the commands it follows
        self._repeats = command is not None and (command.name, command.unit) == (name, unit)  # a servo's angle
        self._error, self._frozen = Timer(dt), Frozen(dt)

    def sample(self, measured: float, reference: float | None, commands: Sequence[float]) -> str:
        """Count one more sample; why it ends the experiment, or ""."""
        limits, of, name = self._limits, partial(show_value, unit=self._unit), self.name
        if not math.isfinite(measured):
            return (
                f"the measurement {name} is {of(measured)}. "
                "Look whether the sensor sees its target, and is within its range."
            )
        if not limits.least <= measured <= limits.most:
            return (
                f"the measurement {name} is {of(measured)}, {show_span(limits.least, limits.most, self._unit)} are "
                "allowed. Look at the sensor's zero, at the sign of the command, and at the controller's gains."
            )
        if reference is None and self._at is not None and self._repeats:
            reference = commands[self._at]
        return self._is_frozen(measured, commands) or self._is_off(measured, reference)

    def _is_frozen(self, measured: float, commands: Sequence[float]) -> str:
        if self._at is None or self._command is None:
            return ""
        frozen, limits, command = self._frozen, self._all, self._command
        frozen.count(measured, commands[self._at])
        share = limits.frozen_share * (command.limits.high - command.limits.low)
        if frozen.time < limits.frozen_time or frozen.moved <= share:
            return ""
        return (
            f"the measurement {self.name} stays {show_value(measured, self._unit)} to the last bit for "
            f"{frozen.time:.3g} s while the command {command.name} moves by "
            f"{show_value(frozen.moved, command.unit)}, {limits.frozen_time:g} s are allowed. Look "
            "whether the sensor still measures, and whether anything moves: power, supply, a blocked part."
        )

    def _is_off(self, measured: float, reference: float | None) -> str:
        limits, of = self._limits, partial(show_value, unit=self._unit)
        if reference is None or limits.error is None:
            return ""
        if self._error.count(abs(reference - measured) > limits.error) <= limits.error_time:
            return ""
        return (
            f"the error of {self.name} is {of(reference - measured)} and was above {of(limits.error)} for "
            f"{self._error.time:.3g} s, {limits.error_time:g} s are allowed. Look at the log: a loop that oscillates "
            "has too high gains, one that lags has too low ones, or a valve that does not open; a motor may be blocked."
        )


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

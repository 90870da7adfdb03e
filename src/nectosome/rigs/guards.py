"""Guards between a controller and a rig: they limit commands and check every sample."""

import math

from .limits import Frozen, Limits, Overruns, Timer, slewed
from .rig import Rig


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

    def allowed(self, wanted: float, before: float, elapsed: float) -> float:
        """The command nearest to the wanted one, `elapsed` [s] after the one before.

        No more than dt counts, so that a pause is not made up for by a jump.
        """
        limits = self.limits
        within = min(max(wanted, limits.low), limits.high)
        most = limits.slew * min(max(elapsed, 0.0), self.dt)
        command = slewed(within, before, most)
        self._clamped += within != wanted
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

    def wanted(self, command: float) -> str:
        """Why what the controller asks for ends the experiment, or ""."""
        if math.isfinite(command):
            return ""
        return (
            f"the controller asks for {command:g} {self._rig.command_unit}, which is no command. "
            "Look at its numbers, and at the last measurements."
        )

    def counts(self) -> dict[str, float]:
        """Samples whose command was out of its range, or too fast, samples that were late, and the largest delay."""
        seen = self._overruns
        return {"clamped": self._clamped, "slowed": self._slowed, "overruns": seen.total, "latest": seen.latest}

    def _clock(self, late: float) -> str:
        limits, seen = self.limits, self._overruns
        if not late >= -limits.overrun * self.dt:  # nor where it is NaN
            return (
                f"the sample comes {-late:.3g} s too early. "
                "Look at the rig's clock: it went back, or does not wait as long as it is told."
            )
        hint = "Look at what else runs on this machine, at the time that the rig takes to answer, or take a longer dt."
        if seen.in_row >= limits.overruns_in_row:
            return (
                f"{seen.in_row} samples in a row are late by more than {limits.overrun:g} of dt "
                f"({self.dt:g} s), this one by {late:.3g} s. {hint}"
            )
        if seen.total > max(limits.overruns_share * self._count, limits.overruns_in_row):
            return (
                f"{seen.total} samples are late by more than {limits.overrun:g} of dt ({self.dt:g} s), at most "
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

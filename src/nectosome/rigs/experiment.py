"""An experiment: a rig plays signals or tracks references under controllers, within limits, with a log.

Every run ends in one place (`Experiment.run`): the command ramps to 0 at the slew limit, the rig is vented and closed,
the log ends. That holds after the last sample, for a stop by the guards, for errors of the rig, of the controller and
of the disk, for Ctrl-C, Ctrl-Z, a closed terminal and SIGTERM.

It cannot hold for a process that is killed with SIGKILL or stopped with SIGSTOP, for a machine that hangs, is suspended
or loses its power, or for a driver whose call does not return: then the last command stays in effect. Only the device
itself can help there. Use a watchdog that cuts the power when no commands come, as NI cards and servos have, or a valve
that closes when its signal is lost; and keep a switch within reach.
"""

import json
import math
import signal
import threading
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from nectosome.io import provenance
from nectosome.units import InputError, show_span

from .guards import Guards, Limits, slewed
from .laws import Law
from .log import LogError, RunLog
from .rig import Rig, RigError

if TYPE_CHECKING:
    import xarray


Progress = Callable[[float], bool | None]
_PULSE = 0.1  # [s] between calls of it at most: who ends a long run with it does not wait
# those that end or stop a process unless it says otherwise, closing a terminal and Ctrl-Z included
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK", "SIGTSTP")


class AbortError(Exception):
    """A guard ends the experiment."""


class CancelledError(Exception):
    """The caller's progress function ends the experiment."""


@dataclass
class SamplingLoop:
    """The samples of one run, and the ramp back to 0; `check`, called between them, raises to end them."""

    rig: Rig
    law: Law
    guards: Guards
    log: RunLog
    check: Callable[[], None]
    progress: Progress | None = None
    _commands: tuple[float, ...] = field(default=(), init=False)  # the last ones that the rig has taken
    _written: float = field(default=0.0, init=False)  # their time
    _begun: bool = field(default=False, init=False)

    def __post_init__(self):
        self._commands = (0.0,) * len(self.rig.commands)

    def samples(self) -> None:
        """Open the rig and take all samples, at multiples of dt."""
        self.rig.open()
        start = self.rig.now()
        self._written = start - self.guards.dt  # the commands were 0 before
        count = self.law.count
        references = {name: signal.tolist() for name, signal in self.law.references.items()}
        pulse = max(min(count // 100, int(_PULSE / self.guards.dt)), 1)
        for k in range(count):
            self.check()
            self.rig.wait(start + k * self.guards.dt)
            time = self.rig.now() - start
            wanted = {name: signal[k] for name, signal in references.items()}
            self._sample(k, time, wanted, time - k * self.guards.dt)
            if self.progress is not None and k % pulse == 0 and self.progress((k + 1) / count) is False:
                raise CancelledError

    def _sample(self, k: int, time: float, references: dict[str, float], late: float) -> None:
        measured = self.rig.measure()
        why = self.guards.sample(late, references, measured, self._commands)
        if not why:
            if not self._begun:
                self.law.begin(measured)
                self._begun = True
            commands = self.law.commands(k, measured)
            why = self.guards.not_finite(commands)
            if not why:
                self._write(commands)
        try:
            self.log.append(time, *measured, *self._commands, *references.values(), late)
        finally:
            if why:
                raise AbortError(f"at {time:.3f} s {why}")

    def _write(self, unlimited: tuple[float, ...]) -> None:
        now = self.rig.now()
        commands = self.guards.allowed(unlimited, self._commands, now - self._written)
        self.rig.write(commands)
        self._commands, self._written = commands, now

    def ramp(self) -> None:
        """Ramp to commands of 0 at the slew limit of each.

        It begins with the last commands that the rig has taken; those whose writing failed may be in effect or not.
        """
        most = [self.guards.limits.commands[name].slew * self.guards.dt for name in self.rig.commands]
        steps = [self._commands] if any(self._commands) else []
        while steps and any(steps[-1]):
            steps.append(tuple(slewed(0.0, last, rate) for last, rate in zip(steps[-1], most, strict=True)))
        for commands in steps:
            self.check()
            self.rig.wait(self.rig.now() + self.guards.dt)
            self.rig.write(commands)


class Interrupts:
    """Within it, signals become KeyboardInterrupt in steps that allow them; other signals wait until its end.

    Only the main thread receives signals: in any other one nothing changes. Signals that are ignored stay so.
    """

    def __init__(self):
        self._before: dict[int, Any] = {}
        self._listening = False
        self._held = 0  # a signal that has come and not been raised

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._before[number] = signal.signal(number, self._take)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if self._held:
            signal.raise_signal(self._held)

    def allowed(self, step: Callable[[], object]) -> BaseException | None:
        """Take a step that a signal may break off, at once if it has come before; return its error, or None.

        What a signal raises is lost where Python runs something that must not fail, such as a finalizer. The step
        calls `check` again and again, which raises the signal then.
        """
        try:
            try:
                self._listening = True
                self.check()
                step()
                self.check()
            finally:
                self._listening = False
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                self._held = 0
            return error
        return None

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal has come."""
        if self._held:
            self._listening = False  # no other one until this is caught
            raise KeyboardInterrupt(signal.Signals(self._held).name)

    def _take(self, number: int, _: object) -> None:
        self._held = number
        if self._listening:
            self.check()


def caught(step: Callable[[], object]) -> BaseException | None:
    """Take a step; return its error, or None."""
    try:
        step()
    except BaseException as error:
        return error
    return None


Status = Literal["finished", "aborted", "failed", "interrupted"]


@dataclass(frozen=True)
class RigRun:
    """Status, reason and measurements of an experiment; `path` is its file."""

    status: Status
    reason: str
    data: "xarray.Dataset"
    path: Path


@dataclass(frozen=True)
class Experiment:
    """A rig and what gives it commands, in samples dt [s] apart; `name` is that of the signals or references.

    - attributes: more of the log's, such as the conditions of a run.
    """

    rig: Rig
    law: Law
    limits: Limits
    dt: float
    name: str = "reference"
    attributes: Mapping[str, str] = field(default_factory=dict)

    def __post_init__(self):
        if not (math.isfinite(self.dt) and self.dt > 0):
            raise InputError(f"{self.dt:g} s between samples; a number above 0 expected.", field="dt")
        for name, reference in self.law.references.items():
            unit, limits = self.rig.measurements[name], self.limits.measurements.get(name)
            if limits is not None and not ((limits.least <= reference) & (reference <= limits.most)).all():
                raise InputError(
                    f"is from {show_span(float(np.min(reference)), float(np.max(reference)), unit)}, "
                    f"{show_span(limits.least, limits.most, unit)} are allowed for {name}.",
                    field="reference",
                )
        self._guards()

    def run(self, log_path: str | Path, progress: Progress | None = None) -> RigRun:
        """Run it, log it in a netCDF file, and leave the rig without power.

        - progress(share): called a hundred times and at least each 0.1 s; the run is interrupted where it is False.

        The log holds each measurement under its name, each command as `NAME.command`, as it was written after it, each
        reference as `NAME.reference`, and `late` [s]. Faults of a device or of the disk, and interruptions, are
        returned as a status. Any other error is raised again when the rig is safe and the log has ended. Raises
        InputError, before anything moves and without a log, where the log cannot be written or the rig not be opened:
        its package, its driver, the device or the rights are missing.
        """
        self.law.prepare()
        guards = self._guards()
        with Interrupts() as interrupts:
            log = RunLog(log_path, self._attributes(), self._units())
            loop = SamplingLoop(self.rig, self.law, guards, log, interrupts.check, progress)
            first, commanded = interrupts.allowed(loop.samples), self.rig.commanded
            if isinstance(first, RigError) and not commanded:
                caught(self.rig.close)
                log.discard()
                raise InputError(f"{first} No command was sent.") from first
            errors = {
                "": first,
                "On the way to a command of 0": interrupts.allowed(loop.ramp),
                "When it was vented": caught(self.rig.vent),
            }
            if errors["When it was vented"] and commanded:
                errors[_ALARM] = caught(self.rig.vent)
            errors["When it was closed"] = caught(self.rig.close)
            wrong = {where: error for where, error in errors.items() if error is not None}
            run = _ended(log, wrong, guards, self.rig.remarks())
        for error in wrong.values():
            if not isinstance(error, _REPORTED):
                error.add_note(f"{run.reason} The log is {run.path}.")
                raise error
        return run

    def _guards(self) -> Guards:
        law = self.law
        tracked = law.references if law.controlled else ()
        return Guards(
            self.limits, self.rig.commands, self.rig.measurements, self.dt, law.count, tracked, law.controlled
        )

    def _units(self) -> dict[str, str]:
        """Units of the log's columns, in their order."""
        of = self.rig.measurements
        commands = {f"{name}.command": unit for name, unit in self.rig.commands.items()}
        references = {f"{name}.reference": of[name] for name in self.law.references}
        return {"time": "s", **of, **commands, **references, "late": "s"}

    def _attributes(self) -> dict[str, Any]:
        settings = {"dt": self.dt, "limits": asdict(self.limits), "samples": self.law.count}
        return {
            **self.attributes,
            "title": f"{self.name} on {self.rig.name}",
            "rig": self.rig.name,
            "reference": self.name,
            "controller": self.law.about,
            "loops": json.dumps(dict(zip(self.law.controlled, self.law.references, strict=True))),
            "dt": self.dt,
            "provenance": json.dumps(provenance(settings)),
        }


_ALARM = "Vented again in vain, TAKE ITS POWER OUT BY HAND"
_REPORTED = (AbortError, CancelledError, RigError, LogError, KeyboardInterrupt)


def _ended(log: RunLog, wrong: dict[str, BaseException], guards: Guards, remarks: list[str]) -> RigRun:
    """End the log with the status and all reasons, the first one first, then an alarm: messages are cut."""
    status = _status(next(iter(wrong.values()), None))
    ordered = [*wrong][:1] + sorted([*wrong][1:], key=lambda where: where != _ALARM)
    reasons = [f"{where}: {_sentence(wrong[where])}" if where else _sentence(wrong[where]) for where in ordered]
    reason = " ".join(reasons) or "all samples were taken."
    told = {"remarks": " ".join(remarks)} if remarks else {}
    data, path, lost = log.end({"status": status, "status_reason": reason} | guards.counts() | told)
    if lost:
        reason = f"{reason} The log stays in {path}: {lost}"
        status = "failed" if status == "finished" else status
    return RigRun(status, reason, data, path)


def _status(first: BaseException | None) -> Status:
    if first is None:
        return "finished"
    if isinstance(first, KeyboardInterrupt | CancelledError):
        return "interrupted"
    return "aborted" if isinstance(first, AbortError) else "failed"


def _sentence(error: BaseException) -> str:
    if isinstance(error, CancelledError):
        return "it was cancelled."
    if isinstance(error, KeyboardInterrupt):
        return f"it was interrupted{f' by {error}' if str(error) else ''}."
    text = " ".join(str(error).split())
    return text if isinstance(error, _REPORTED) else f"{type(error).__name__}: {text}"

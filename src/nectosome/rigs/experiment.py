"""An experiment: a rig tracks a reference under a controller, within limits, with a log.

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
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import equinox as eqx
import numpy as np
from jaxtyping import Float

from nectosome.controllers import Controller
from nectosome.io import provenance
from nectosome.units import InputError

from .guards import Guards, Limits
from .interrupts import Interrupts, caught
from .log import LogError, RunLog
from .rig import Rig, RigError
from .sampling_loop import AbortError, CancelledError, ControlLaw, Progress, SamplingLoop

if TYPE_CHECKING:
    import xarray


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
    """A rig, a controller and a reference, in samples dt [s] apart; `name` is that of the reference."""

    rig: Rig
    controller: Controller
    reference: Float[np.ndarray, "n"]
    limits: Limits
    dt: float
    name: str = "reference"

    def __post_init__(self):
        limits, unit = self.limits, self.rig.measured_unit
        if not (math.isfinite(self.dt) and self.dt > 0):
            raise InputError(f"{self.dt:g} s between samples; a number above 0 expected.", field="dt")
        if np.ndim(self.reference) != 1 or not np.size(self.reference):
            raise InputError("a row of samples expected.", field="reference")
        if not ((limits.least <= self.reference) & (self.reference <= limits.most)).all():
            raise InputError(
                f"is from {np.min(self.reference):g} to {np.max(self.reference):g} {unit}, "
                f"{limits.least:g} to {limits.most:g} {unit} are allowed.",
                field="reference",
            )

    def run(self, log_path: str | Path, progress: Progress | None = None) -> RigRun:
        """Run it, log it in a netCDF file, and leave the rig without power.

        - progress(share): called a hundred times; the run is interrupted where it returns False.

        Faults of a device or of the disk, and interruptions, are returned as a status. Any other error is raised again
        when the rig is safe and the log has ended. Raises InputError, before anything moves and without a log, where
        the log cannot be written or the rig not be opened: its package, its driver, the device or the rights are
        missing.
        """
        law = ControlLaw(self.controller.planned(self.reference, self.dt))
        guards = Guards(self.limits, self.rig, self.dt, len(self.reference))
        with Interrupts() as interrupts:
            of = self.rig.measured_unit
            units = {"time": "s", "reference": of, "measured": of, "command": self.rig.command_unit, "late": "s"}
            log = RunLog(log_path, self._attributes(), units)
            loop = SamplingLoop(self.rig, law, self.reference, guards, log, interrupts.check, progress)
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
            run = _ended(log, wrong, guards)
        for error in wrong.values():
            if not isinstance(error, _REPORTED):
                error.add_note(f"{run.reason} The log is {run.path}.")
                raise error
        return run

    def _attributes(self) -> dict[str, Any]:
        settings = {"dt": self.dt, "limits": asdict(self.limits), "samples": len(self.reference)}
        return {
            "title": f"{self.name} on {self.rig.name}",
            "rig": self.rig.name,
            "reference": self.name,
            "controller": eqx.tree_pformat(self.controller, short_arrays=False),
            "dt": self.dt,
            "provenance": json.dumps(provenance(settings)),
        }


_ALARM = "Vented again in vain, TAKE ITS POWER OUT BY HAND"
_REPORTED = (AbortError, CancelledError, RigError, LogError, KeyboardInterrupt)


def _ended(log: RunLog, wrong: dict[str, BaseException], guards: Guards) -> RigRun:
    """End the log with the status and all reasons, the first one first, then an alarm: messages are cut."""
    status = _status(next(iter(wrong.values()), None))
    ordered = [*wrong][:1] + sorted([*wrong][1:], key=lambda where: where != _ALARM)
    reasons = [f"{where}: {_sentence(wrong[where])}" if where else _sentence(wrong[where]) for where in ordered]
    reason = " ".join(reasons) or "all samples were taken."
    data, path, lost = log.end({"status": status, "status_reason": reason} | guards.counts())
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

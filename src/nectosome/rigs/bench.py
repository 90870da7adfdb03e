"""A rig under controllers: a rehearsal on its model, where there is one, then experiments."""

import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome._renamed import former_method
from nectosome.controllers import BlockLoopRecord
from nectosome.identification.fits.errors import range_errors
from nectosome.units import InputError, did_you_mean, shorten

from .experiment import Experiment, Progress, RigRun
from .guards import NOTHING, Limits
from .laws import Loop, Tracked
from .rig import Devices, Rig
from .simulated_rig import SimulatedRig

if TYPE_CHECKING:
    import xarray as xr


class Pair(NamedTuple):
    """A command and the measurement that a controller makes follow a reference by it."""

    command: str
    measurement: str

    @classmethod
    def of(cls, rig: Rig, command: str | None = None, measurement: str | None = None) -> "Pair":
        """Those of a rig; one that is not named is the only one. Raises InputError for none, or several."""
        return cls(
            _one("command", "command", command, rig.commands),
            _one("measure", "measurement", measurement, rig.measurements),
        )


def _one(field: str, kind: str, name: str | None, known: Mapping[str, str]) -> str:
    if name is None and len(known) == 1:
        return next(iter(known))
    if name is None:
        have = f"has several {kind}s: {', '.join(known)}. Name one." if known else f"has no {kind}."
        raise InputError(f"the rig {have}", field=field)
    if name in known:
        return name
    message = f'"{shorten(name)}" is no {kind} of this rig: {", ".join(known) or "none"}.'
    raise InputError(message + did_you_mean(name, known), field=field)


@dataclass(frozen=True)
class Bench:
    """A rig, loops, and a simulated rig of its model, on which they are rehearsed first.

    - loops: by the command that each sets, with the controllers of the first run.
    - name: of the references.
    - model: its channels have the names of the rig's, those of the loops at least; without it nothing is known before
      the rig moves.
    """

    rig: Rig
    limits: Limits
    dt: float  # between samples [s]
    loops: Mapping[str, Loop]
    name: str = "reference"
    model: Rig | None = None
    of = staticmethod(former_method("rigs.bench.Bench.of"))

    def rehearse(self, rounds: int = 1, progress: Progress | None = None) -> "list[xr.Dataset]":
        """The runs on the model, as `Experiment` logs them. Raises InputError where the guards of the rig would end it.

        It finds an unstable loop, gains that are too high, a reference out of reach and learning that does not
        converge, but no errors of the model.
        """
        runs = list["xr.Dataset"]()
        if self.model is None:
            return runs
        with tempfile.TemporaryDirectory() as folder:
            logs = [Path(folder) / f"rehearsal_{k}.nc" for k in range(rounds)]
            for run in self._rounds(self.model, self._limits_of(self.model), logs, progress):
                if run.status == "interrupted":
                    raise KeyboardInterrupt
                if run.status != "finished":
                    raise InputError(f"on the model it would end, nothing was moved: {run.reason}")
                runs.append(run.data)
        return runs

    def runs(self, logs: Sequence[Path], progress: Progress | None = None) -> Iterator[RigRun]:
        """A run on the rig for each log, until one ends otherwise; what learns has learned from those before."""
        return self._rounds(self.rig, self.limits, logs, progress)

    def errors(self, run: RigRun) -> dict[str, tuple[float, float]]:
        """Rms and largest error of the first loop in the last run [percent of the reference's range].

        `measured`, and `true` on a simulated rig; nothing for a constant reference.
        """
        loop = next(iter(self.loops.values()))
        measured = run.data[loop.measurement].values
        target, known = loop.reference[: len(measured)], np.isfinite(measured)
        if not known.any() or np.ptp(target[known]) == 0:
            return {}
        errors = {"measured": range_errors(measured[known], target[known])}
        key = loop.measurement.partition(".")[0]
        device = self.rig.devices[key] if isinstance(self.rig, Devices) else self.rig
        if isinstance(device, SimulatedRig):
            errors["true"] = range_errors(np.array(device.outputs[: len(measured)]), target)
        return errors

    def _rounds(self, rig: Rig, limits: Limits, logs: Sequence[Path], progress: Progress | None) -> Iterator[RigRun]:
        loops = self.loops
        for k, log in enumerate(logs):
            report = None if progress is None else lambda share, k=k: progress((k + share) / len(logs))
            run = Experiment(rig, Tracked(rig, loops, self.dt), limits, self.dt, self.name).run(log, report)
            yield run
            if run.status != "finished":
                return
            loops = {command: self._next(command, loop, run.data) for command, loop in self.loops.items()}

    def _next(self, command: str, loop: Loop, data: "xr.Dataset") -> Loop:
        """A loop after a run."""
        columns = f"{loop.measurement}.reference", loop.measurement, f"{command}.command"
        target, measured, sent = (jnp.asarray(data[name].values) for name in columns)
        record = BlockLoopRecord(target, measured, measured, sent)
        return replace(loop, controller=loop.controller.after(record, self.dt))

    def _limits_of(self, model: Rig) -> Limits:
        """Those of the channels that the model has."""
        limits = self.limits
        known = {name: limits.measurements[name] for name in model.measurements if name in limits.measurements}
        return replace(
            limits,
            commands={name: limits.commands[name] for name in model.commands},
            measurements={
                name: one if one.follows in (None, NOTHING, *model.commands) else replace(one, follows=NOTHING)
                for name, one in known.items()
            },
        )


def tracked(data: "xr.Dataset", measurement: str) -> "tuple[Float[np.ndarray, 'n'], Float[np.ndarray, 'n']]":
    """Measurement and reference of a run, at the samples where there is a measurement."""
    measured, reference = data[measurement].values, data[f"{measurement}.reference"].values
    known = np.isfinite(measured)
    return measured[known], reference[known]

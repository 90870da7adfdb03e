"""A rig under a controller: a rehearsal on its model, where there is one, then the experiment."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.controllers import (
    PID,
    WITH_MODEL,
    ActuatorLimits,
    BlockLoop,
    BlockLoopRecord,
    Controller,
    HystereticModel,
    Learner,
    PIDGains,
    block_relay_gains,
    check_reachable,
    controller_of,
    hysteretic,
    margins,
    open_loop,
    schedule_of,
    smooth_pid,
    time_scaled,
)
from nectosome.controllers.autotune import SPEEDS
from nectosome.drives import Chain, DeadTime, Saturation, Sensor, SlewLimit
from nectosome.identification.fits.errors import range_errors
from nectosome.units import InputError, did_you_mean, dimension_of, shorten, show_quantity

from .devices import Devices
from .experiment import Experiment, RigRun
from .guards import CommandLimits, Guards, Limits, MeasurementLimits
from .laws import Loop, Tracked
from .rig import Rig
from .simulated_rig import SimulatedRig

if TYPE_CHECKING:
    import xarray as xr

    from nectosome.identification.hysteresis.fit import Identified

_SMALL, _LARGE = 0.1, 0.5  # of the range of commands, at which the loop must be stable
_QUIET = 1e-4  # of the range of measurements: the least noise that is assumed
_MOST_DELAY = 12  # steps of a block, unless the delay of the model is longer


class BenchRun(NamedTuple):
    """A run, and its errors (rms, largest) [percent of the reference's range]: measured, and true on a simulated rig.

    None where there is nothing to compare.
    """

    run: RigRun
    measured: tuple[float, float] | None
    true: tuple[float, float] | None


class Pair(NamedTuple):
    """A command and the measurement that a controller makes follow a reference by it."""

    command: str
    measurement: str

    @classmethod
    def of(cls, rig: Rig, command: str | None = None, measurement: str | None = None) -> "Pair":
        """Those of a rig; one that is not named is the only one. Raises InputError for none, or several."""
        return cls(_one("command", command, rig.commands), _one("measurement", measurement, rig.measurements))


def _one(kind: str, name: str | None, known: Mapping[str, str]) -> str:
    if name is None and len(known) == 1:
        return next(iter(known))
    if name is None:
        have = f"has several {kind}s: {', '.join(known)}. Name one of them." if known else f"has no {kind}."
        raise InputError(f"the rig {have}", field=kind)
    if name in known:
        return name
    message = f'"{shorten(name)}" is no {kind} of this rig: {", ".join(known) or "none"}.'
    raise InputError(message + did_you_mean(name, known), field=kind)


@dataclass(frozen=True)
class Bench:
    """A rig with limits and a controller; with a model of it, from command to measurement, for rehearsals."""

    rig: Rig
    limits: Limits
    dt: float  # between samples [s]
    pair: Pair
    controller: Controller | Learner
    model: HystereticModel | None = None
    loop: BlockLoop | None = None  # the model under a controller

    @classmethod
    def of(
        cls,
        rig: Rig,
        limits: Limits,
        dt: float,
        reference: Float[np.ndarray, "n"],
        controller: str | None = None,
        gains: PIDGains | None = None,
        model: "Identified | None" = None,
        pair: Pair | None = None,
    ) -> "Bench":
        """Controller by its name, one of CONTROLLERS: `ff-pid` with a model, else `pid`, unless given.

        - gains: in SI. Without them those of a relay experiment on the model, detuned along the reference, or along
          sines from its lowest to its highest frequency.
        - model: of the rig, as `fit_hysteresis` finds it.
        - pair: its command and measurement, where it has several.

        Raises InputError where gains or a model are needed, and for a model of other units or without inverse.
        """
        name = controller or ("pid" if model is None else "ff-pid")
        pair = pair or Pair.of(rig)
        limits.check(rig.commands, rig.measurements)
        command, measured = limits.commands[pair.command], limits.measurements.get(pair.measurement)
        if measured is None:
            raise InputError("is missing: give least, most and error.", field=f"measurements.{pair.measurement}")
        within = _actuator_limits(command)
        if model is None:
            if name in WITH_MODEL:
                raise InputError(f"{name} needs a model of the rig.", field="model")
            if gains is None:
                raise InputError("without a model no gains can be found: give gains, or a model.", field="gains")
            return cls(rig, limits, dt, pair, controller_of(name, gains, within, dt))
        units = rig.commands[pair.command], rig.measurements[pair.measurement]
        if units != ("Pa", "m"):
            units = f"{units[0]} and measures {units[1]}"
            raise InputError(f"is from Pa to m; the rig takes {units}.", field="model")
        loop = actuator_loop(model, command, measured, dt)
        known = hysteretic(model.hysteresis(), model.dynamics(), _delay(model, dt))
        used = gains or _found_gains(loop, command, reference, name == "scheduled")
        law = controller_of(name, used, within, dt, known, float(loop.sensor.noise))
        return cls(rig, limits, dt, pair, law, known, loop)

    def check(self, reference: Float[np.ndarray, "n"]) -> None:
        """Rehearse on the model; without one, nothing is known before the rig moves.

        Raises InputError for a reference that is out of reach, an unstable loop, and a run that the guards would end.
        """
        if self.model is None or self.loop is None:
            return
        limits = self.limits.commands[self.pair.command]
        units = self.rig.commands[self.pair.command], self.rig.measurements[self.pair.measurement]
        dimensions = dimension_of(units[0]), dimension_of(units[1])
        check_reachable(self.model, _actuator_limits(limits), reference, self.dt, dimensions)
        for share in (_SMALL, _LARGE):
            size = share * max(limits.high, -limits.low)
            found = margins(*open_loop(self.loop, self._first, size))
            if found.phase <= 0:
                raise InputError(
                    f"the loop is unstable for commands of {show_quantity(size, dimensions[0])}: its limit of "
                    f"stability is at {found.gain:.2g} times these gains. Take lower ones.",
                    field="gains",
                )
        self._rehearse(self.loop, reference)

    def _rehearse(self, loop: BlockLoop, reference: Float[np.ndarray, "n"]) -> None:
        """Closed-loop run of the model. Raises InputError where the guards would end it, with their reason.

        It finds an unstable loop, gains that are too high and a reference out of reach, but no errors of the model.
        """
        record = loop.run(self._first, reference)
        signals = reference.tolist(), np.asarray(record.measured).tolist(), np.asarray(record.command).tolist()
        name, of = self.pair.command, self.pair.measurement
        units = {name: self.rig.commands[name]}, {of: self.rig.measurements[of]}
        limits = replace(
            self.limits, commands={name: self.limits.commands[name]},
            measurements={of: replace(self.limits.measurements[of], follows=name)},
        )  # fmt: skip
        guards, before = Guards(limits, *units, self.dt, len(reference), {of}, {name}), (0.0,)
        for k, (target, measured, command) in enumerate(zip(*signals, strict=True)):
            why = guards.sample(0.0, {of: target}, (measured,), before) or guards.not_finite((command,))
            if why:
                raise InputError(f"on the model it would end at {k * self.dt:.3f} s, nothing was moved: {why}")
            before = guards.allowed((command,), before, self.dt)

    def runs(
        self,
        reference: Float[np.ndarray, "n"],
        name: str,
        logs: Sequence[Path],
        progress: Callable[[int, float], None] | None = None,
    ) -> Iterator[BenchRun]:
        """One experiment for each log, in turn; a learning controller learns from each run for the next."""
        law = self._first
        for k, log in enumerate(logs):
            report = None if progress is None else lambda share, k=k: progress(k, share)
            tracked = Tracked(self.rig, {self.pair.command: Loop(self.pair.measurement, law, reference)}, self.dt)
            run = Experiment(self.rig, tracked, self.limits, self.dt, name).run(log, report)
            yield _scored(run, self.rig, self.pair.measurement, reference)
            if isinstance(self.controller, Learner):
                law = self.controller.after(record_of(run.data, self.pair))

    @property
    def _first(self) -> Controller:
        return self.controller.first if isinstance(self.controller, Learner) else self.controller


def actuator_loop(
    model: "Identified", limits: CommandLimits, measured: MeasurementLimits, dt: float, noise: float | None = None
) -> BlockLoop:
    """A rig as a block in a loop: its delay, limits of the command, hysteresis, dynamics, and its sensor.

    The delay is the dead time of the model; one sample where that was not fitted. Recordings of a rig have commands
    that were written right after the measurement of their sample, as those of a loop are: what was found in them is the
    whole delay, to which no sample is added.
    `noise` [m] is that of the sensor; the residual noise of the identification unless given.
    """
    slew = min(limits.slew, model.theta.get("slew", limits.slew))
    within = Saturation(jnp.asarray(limits.low), jnp.asarray(limits.high)), SlewLimit(jnp.asarray(slew))
    delay = _delay(model, dt)
    most = max(_MOST_DELAY, math.ceil(delay / dt * BlockLoop.substeps) + 1)
    plant = Chain((DeadTime(jnp.asarray(delay), most), *within, model.hysteresis(), model.dynamics()))
    spread = max(model.noise, _QUIET * (measured.most - measured.least)) if noise is None else noise
    return BlockLoop(plant, Sensor(*(jnp.asarray(x) for x in (spread, measured.least, measured.most))), dt)


def _delay(model: "Identified", dt: float) -> float:
    """From a command to its effect [s]."""
    return model.theta.get("dead_time", dt)


def _pid(gains: Float[np.ndarray, "3"], limits: CommandLimits, dt: float) -> PID:
    return smooth_pid(gains, limits.low, limits.high, dt, limits.slew)


def _found_gains(
    loop: BlockLoop, limits: CommandLimits, reference: Float[np.ndarray, "n"], scheduled: bool
) -> PIDGains:
    """Gains of a relay experiment on the model, detuned for the least integral of time times error."""
    amplitude = _LARGE * min(limits.high, -limits.low)
    if amplitude <= 0:
        raise InputError("commands of both signs are needed to find gains: give gains.", field="gains")
    found = block_relay_gains(loop, amplitude).gains
    frequencies, courses = schedule_of(reference, loop.dt, 0.0) if scheduled else (None, [reference])
    return PIDGains(np.stack([_detuned(loop, limits, found, course) for course in courses]), frequencies)


def _detuned(
    loop: BlockLoop, limits: CommandLimits, found: Float[np.ndarray, "3"], course: Float[np.ndarray, "n"]
) -> Float[np.ndarray, "3"]:
    time = loop.dt * np.arange(len(course))
    best, least = found, np.inf
    for speed in SPEEDS:
        gains = time_scaled(found, speed)
        record = loop.run(_pid(gains, limits, loop.dt), course)
        error = float(np.sum(time * np.abs(np.asarray(record.output) - course)))
        if error >= least:
            break
        best, least = gains, error
    return best


def _actuator_limits(limits: CommandLimits) -> ActuatorLimits:
    return ActuatorLimits(*(jnp.asarray(x) for x in (limits.low, limits.high, limits.slew)))


def record_of(data: "xr.Dataset", pair: Pair) -> BlockLoopRecord:
    """Reference, measurement and command of a run, for a controller that learns from it."""
    columns = f"{pair.measurement}.reference", pair.measurement, f"{pair.command}.command"
    target, measured, command = (jnp.asarray(data[name].values) for name in columns)
    return BlockLoopRecord(target, measured, measured, command)


def _scored(run: RigRun, rig: Rig, name: str, reference: Float[np.ndarray, "n"]) -> BenchRun:
    measured = run.data[name].values
    target, known = reference[: len(measured)], np.isfinite(measured)
    if not known.any() or np.ptp(target[known]) == 0:
        return BenchRun(run, None, None)
    device = rig.devices[name.partition(".")[0]] if isinstance(rig, Devices) else rig
    outputs = np.array(device.outputs[: len(measured)]) if isinstance(device, SimulatedRig) else None
    true = None if outputs is None else range_errors(outputs, target)
    return BenchRun(run, range_errors(measured[known], target[known]), true)

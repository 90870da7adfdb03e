"""A rig under a controller: a rehearsal on its model, where there is one, then the experiment."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.controllers import (
    PID,
    ActuatorLimits,
    BlockLoop,
    BlockLoopRecord,
    Controller,
    Feedforward,
    HystereticModel,
    Learner,
    Predictive,
    block_relay_gains,
    check_reachable,
    hysteretic,
    margins,
    open_loop,
    smooth_pid,
    time_scaled,
)
from nectosome.controllers.autotune import SPEEDS
from nectosome.controllers.feedforward import SMOOTHING
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
    from nectosome.identification.hysteresis.fit import Identified

CONTROLLERS = ("pid", "ff-pid", "ilc", "mpc")
_SMALL, _LARGE = 0.1, 0.5  # of the range of commands, at which the loop must be stable
_LEARNING, _SHARE, _MILD = 0.15, 0.5, 0.5  # s, over which errors are smoothed; gamma; of the gains, as noise is learned
_HORIZON, _WEIGHT, _WANDER = 30, 0.1, 0.4  # samples; of inputs against outputs; steps of the disturbance by the noise
_QUIET = 1e-4  # of the range of measurements: the least noise that is assumed
_MOST_DELAY = 12  # steps of a block


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
        gains: Float[np.ndarray, "3"] | None = None,
        model: "Identified | None" = None,
        pair: Pair | None = None,
    ) -> "Bench":
        """Controller by its name, one of CONTROLLERS: `ff-pid` with a model, else `pid`, unless given.

        - gains: K_p, K_i, K_d in SI. Without them those of a relay experiment on the model, detuned along the
          reference.
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
        if model is None:
            if name != "pid":
                raise InputError(f"{name} needs a model of the rig.", field="model")
            if gains is None:
                raise InputError("without a model no gains can be found: give gains, or a model.", field="gains")
            return cls(rig, limits, dt, pair, _pid(gains, command, dt))
        units = rig.commands[pair.command], rig.measurements[pair.measurement]
        if units != ("Pa", "m"):
            units = f"{units[0]} and measures {units[1]}"
            raise InputError(f"is from Pa to m; the rig takes {units}.", field="model")
        loop = actuator_loop(model, command, measured, dt)
        known = hysteretic(model.hysteresis(), model.dynamics(), dt)
        used = _found_gains(loop, command, reference) if gains is None else gains
        law = _controller(name, used, known, command, dt, float(loop.sensor.noise))
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
                of = self.pair.measurement
                columns = f"{of}.reference", of, f"{self.pair.command}.command"
                target, measured, command = (jnp.asarray(run.data[name].values) for name in columns)
                law = self.controller.after(BlockLoopRecord(target, measured, measured, command))

    @property
    def _first(self) -> Controller:
        return self.controller.first if isinstance(self.controller, Learner) else self.controller


def actuator_loop(
    model: "Identified", limits: CommandLimits, measured: MeasurementLimits, dt: float, noise: float | None = None
) -> BlockLoop:
    """A rig as a block in a loop: delay of one sample, limits of the command, hysteresis, dynamics, and its sensor.

    `noise` [m] is that of the sensor; the residual noise of the identification unless given.
    """
    slew = min(limits.slew, model.theta.get("slew", limits.slew))
    within = Saturation(jnp.asarray(limits.low), jnp.asarray(limits.high)), SlewLimit(jnp.asarray(slew))
    plant = Chain((DeadTime(jnp.asarray(dt), _MOST_DELAY), *within, model.hysteresis(), model.dynamics()))
    spread = max(model.noise, _QUIET * (measured.most - measured.least)) if noise is None else noise
    return BlockLoop(plant, Sensor(*(jnp.asarray(x) for x in (spread, measured.least, measured.most))), dt)


def _controller(
    name: str, gains: Float[np.ndarray, "3"], model: HystereticModel, limits: CommandLimits, dt: float, noise: float
) -> Controller | Learner:
    if name == "pid":
        return _pid(gains, limits, dt)
    if name == "ff-pid":
        return Feedforward(_pid(gains, limits, dt), model, SMOOTHING)
    if name == "ilc":
        return Learner(Feedforward(_pid(_MILD * gains, limits, dt), model, SMOOTHING), dt, _LEARNING, _SHARE)
    within = _actuator_limits(limits)
    return Predictive(model, within, _HORIZON, _WEIGHT, _WANDER * noise, noise, SMOOTHING)


def _pid(gains: Float[np.ndarray, "3"], limits: CommandLimits, dt: float) -> PID:
    return smooth_pid(gains, limits.low, limits.high, dt, limits.slew)


def _found_gains(loop: BlockLoop, limits: CommandLimits, reference: Float[np.ndarray, "n"]) -> Float[np.ndarray, "3"]:
    """Gains of a relay experiment on the model, detuned for the least integral of time times error."""
    amplitude = _LARGE * min(limits.high, -limits.low)
    if amplitude <= 0:
        raise InputError("commands of both signs are needed to find gains: give gains.", field="gains")
    found, time = block_relay_gains(loop, amplitude).gains, loop.dt * np.arange(len(reference))
    best, least = found, np.inf
    for speed in SPEEDS:
        gains = time_scaled(found, speed)
        record = loop.run(_pid(gains, limits, loop.dt), reference)
        error = float(np.sum(time * np.abs(np.asarray(record.output) - reference)))
        if error >= least:
            break
        best, least = gains, error
    return best


def _actuator_limits(limits: CommandLimits) -> ActuatorLimits:
    return ActuatorLimits(*(jnp.asarray(x) for x in (limits.low, limits.high, limits.slew)))


def _scored(run: RigRun, rig: Rig, name: str, reference: Float[np.ndarray, "n"]) -> BenchRun:
    measured = run.data[name].values
    target, known = reference[: len(measured)], np.isfinite(measured)
    if not known.any() or np.ptp(target[known]) == 0:
        return BenchRun(run, None, None)
    device = rig.devices[name.partition(".")[0]] if isinstance(rig, Devices) else rig
    outputs = np.array(device.outputs[: len(measured)]) if isinstance(device, SimulatedRig) else None
    true = None if outputs is None else range_errors(outputs, target)
    return BenchRun(run, range_errors(measured[known], target[known]), true)

"""A bench of an actuator, whose model from command to measurement is a block with hysteresis."""

import math
from typing import TYPE_CHECKING

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.controllers import (
    ActuatorLimits,
    BlockLoop,
    LoopData,
    PIDGains,
    check_reachable,
    controller_named,
    find_gains,
    hysteretic,
    margins,
    open_loop,
)
from nectosome.drives import Chain, DeadTime, Saturation, Sensor, SlewLimit
from nectosome.units import InputError, dimension_of, show_quantity

from .bench import Bench, Pair
from .guards import CommandLimits, Limits, MeasurementLimits
from .laws import Loop
from .rig import Rig
from .simulated_rig import SimulatedRig

if TYPE_CHECKING:
    from nectosome.identification.hysteresis.fit import Identified

_SMALL, _LARGE = 0.1, 0.5  # of the range of commands, at which the loop must be stable
_QUIET = 1e-4  # of the range of measurements: the least noise that is assumed
_MOST_DELAY = 12  # steps of a block, unless the delay of the model is longer


def actuator_bench(
    rig: Rig,
    limits: Limits,
    dt: float,
    reference: Float[np.ndarray, "n"],
    controller: str | None = None,
    gains: PIDGains | None = None,
    model: "Identified | None" = None,
    pair: Pair | None = None,
    name: str = "reference",
) -> Bench:
    """A controller by its name on a rig: `ff-pid` with a model, else `pid`, unless given.

    - gains: in SI. Without them those of a relay experiment on the model, detuned along the reference, or along sines
      from its lowest to its highest frequency.
    - model: of the rig, as `fit_hysteresis` finds it, for gains, for the controller and for the rehearsal.
    - pair: its command and measurement, where it has several.

    Raises InputError where gains or a model are needed, for a model of other units or without inverse, for a reference
    that is out of reach, and for an unstable loop.
    """
    kind, pair = controller_named(controller or ("pid" if model is None else "ff-pid")), pair or Pair.of(rig)
    limits.check(rig.commands, rig.measurements)
    command, measured = limits.commands[pair.command], limits.measurements.get(pair.measurement)
    if measured is None:
        raise InputError("is missing: give least, most and error.", field=f"measurements.{pair.measurement}")
    within = ActuatorLimits(command.low, command.high, command.slew)
    if model is None:
        if kind.needs_model:
            raise InputError(f"{kind.name} needs a model of the rig.", field="model")
        if gains is None:
            raise InputError("without a model no gains can be found: give gains, or a model.", field="gains")
        law = kind.from_loop(LoopData(gains, within, dt))
        return Bench(rig, limits, dt, {pair.command: Loop(pair.measurement, law, reference)}, name)
    units = rig.commands[pair.command], rig.measurements[pair.measurement]
    if units != model.units:
        words = f"is from {model.units[0]} to {model.units[1]}; the rig takes {units[0]} and measures {units[1]}."
        raise InputError(words, field="model")
    loop = actuator_loop(model, command, measured, dt)
    known = hysteretic(model.hysteresis(), model.dynamics(), _delay(model, dt))
    dimensions = dimension_of(units[0]), dimension_of(units[1])
    check_reachable(known, within, reference, dt, dimensions)
    if gains is None:
        amplitude = _LARGE * min(command.high, -command.low)
        if amplitude <= 0:
            raise InputError("commands of both signs are needed to find gains: give gains.", field="gains")
        found = find_gains(loop, (-amplitude, amplitude), 0.0, within, reference, schedule=kind.scheduled)
        assert found is not None
        gains = found.gains
    law = kind.from_loop(LoopData(gains, within, dt, known, float(loop.sensor.noise)))
    for share in (_SMALL, _LARGE):
        size = share * max(command.high, -command.low)
        margin = margins(*open_loop(loop, law, size))
        if margin.phase <= 0:
            raise InputError(
                f"the loop is unstable for commands of {show_quantity(size, dimensions[0])}: its limit of "
                f"stability is at {margin.gain:.2g} times these gains. Take lower ones.",
                field="gains",
            )
    channels = (pair.command, units[0]), (pair.measurement, units[1])
    step = dt / loop.substeps
    simulated = SimulatedRig(loop.plant, loop.sensor, command=channels[0], measurement=channels[1], dt=step)
    return Bench(rig, limits, dt, {pair.command: Loop(pair.measurement, law, reference)}, name, simulated)


def actuator_loop(
    model: "Identified", limits: CommandLimits, measured: MeasurementLimits, dt: float, noise: float | None = None
) -> BlockLoop:
    """A rig as a block in a loop: its delay, limits of the command, hysteresis, dynamics, and its sensor.

    The delay is the dead time of the model; one sample where that was not fitted. Recordings of a rig have commands
    that were written right after the measurement of their sample, as those of a loop are: what was found in them is the
    whole delay, to which no sample is added.
    `noise` is that of the sensor, in SI; the residual noise of the identification unless given.
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

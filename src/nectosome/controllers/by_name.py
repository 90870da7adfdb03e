"""Controllers by their names, with numbers that follow from gains and a model."""

from dataclasses import replace
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .autotune import smooth_pid
from .contract import Controller
from .feedforward import SMOOTHING, Feedforward, HystereticModel, Learner
from .gains import PIDGains
from .pid import ActuatorLimits, GainSchedule
from .predictive import Predictive
from .references import local_frequency, sine

CONTROLLERS = "pid", "scheduled", "ff-pid", "ilc", "mpc"
WITH_MODEL = "ff-pid", "ilc", "mpc"
_ROWS = 3  # of a schedule
_ONE = 1.1  # highest by lowest frequency, below which they are one
_LEAST = 20  # samples of a course
_SHARE, _MILD = 0.5, 0.5  # gamma; of the gains, as noise is learned


def schedule_of(
    reference: Float[np.ndarray, "k"], dt: float, start: float
) -> tuple[Float[np.ndarray, "m"], list[Float[np.ndarray, "n"]]]:
    """Frequencies of a schedule [Hz], from the lowest to the highest of a reference, and courses to find gains along.

    A course is two periods of a sine as large as the reference, about `start`. Raises InputError for a constant.
    """
    every = local_frequency(reference, dt)
    every = every[every > 0]
    if not every.size or np.ptp(reference) == 0:
        message = "a reference that is constant has no frequency. Take pid, or give gains by frequency."
        raise InputError(message, field="controller")
    low, high = float(every.min()), float(every.max())
    frequencies = np.geomspace(low, high, _ROWS) if high > _ONE * low else np.array([low])
    size = 0.5 * float(np.ptp(reference))
    return frequencies, [start + sine(size, float(f), max(2 / float(f), _LEAST * dt), dt) for f in frequencies]


class Pace(NamedTuple):
    """How far controllers with a model smooth and look ahead."""

    smoothing: float  # of references [s]
    learning: float  # of the errors that are learned from [s]
    horizon: int  # samples
    weight: float  # of inputs of the dynamics against outputs, squared
    wander: float  # steps of the disturbance by the noise of measurements [input by output]


ACTUATOR = Pace(SMOOTHING, 0.15, 30, 0.1, 0.4)
"""Of a pneumatic actuator at 200 Hz, whose dynamics have a gain of 1."""


def controller_of(
    name: str,
    gains: PIDGains,
    limits: ActuatorLimits,
    dt: float,
    model: HystereticModel | None = None,
    noise: float = 0.0,
    pace: Pace = ACTUATOR,
) -> Controller | Learner:
    """One of CONTROLLERS; those WITH_MODEL need one. `noise` is that of measurements.

    Raises InputError for gains by frequency where one row is needed, and for one row where a schedule is.
    """
    if name == "scheduled":
        frequencies, rows = gains.table
        filtering = smooth_pid(rows[0], 0.0, 1.0, dt).filtering
        return GainSchedule(jnp.asarray(frequencies), jnp.asarray(rows), filtering, limits)
    if name == "mpc":
        assert model is not None
        whole = replace(model, delay=jnp.round(model.delay / dt) * dt)  # samples
        return Predictive(whole, limits, pace.horizon, pace.weight, pace.wander * noise, noise, pace.smoothing)
    pid = smooth_pid(gains.row, float(limits.low), float(limits.high), dt, float(limits.slew))
    if name == "pid":
        return pid
    assert model is not None
    if name == "ff-pid":
        return Feedforward(pid, model, pace.smoothing)
    milder = smooth_pid(_MILD * gains.row, float(limits.low), float(limits.high), dt, float(limits.slew))
    return Learner(Feedforward(milder, model, pace.smoothing), dt, pace.learning, _SHARE)

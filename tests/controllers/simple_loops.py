"""What the tests of controllers share: an actuator whose answers are known, in any units, and loops around it."""

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from nectosome.controllers import ActuatorLimits, BlockLoop, HystereticModel, hysteretic
from nectosome.drives import Chain, DeadTime, PrandtlIshlinskii, Sensor, TransferFunction, evenly, second_order

DT = 0.01
FREE = jnp.asarray(jnp.inf)
UNLIMITED = ActuatorLimits(-FREE, FREE, FREE)


def of(*numbers):
    return [jnp.asarray(x, dtype=float) for x in numbers]


def quiet() -> Sensor:
    return Sensor(jnp.zeros(()), -FREE, FREE)


def lag(gain: float, time: float) -> TransferFunction:
    return TransferFunction(*of([gain], [time, 1.0]))


def integrator(gain: float = 1.0) -> TransferFunction:
    return TransferFunction(*of([gain], [1.0, 0.0]))


def linear(gain: float = 1.0) -> PrandtlIshlinskii:
    """No hysteresis: a gain."""
    return PrandtlIshlinskii(*of(gain, [1.0], [0.0]))


def plays(command: float = 1.0, output: float = 1.0) -> PrandtlIshlinskii:
    return evenly(np.array([0.3, 0.2, 0.1]) * output / command, 2.0 * command, 0.5 * output / command)


def dynamics() -> TransferFunction:
    return second_order(*of(1.0, 20.0, 0.9))


def model(command: float = 1.0, output: float = 1.0) -> HystereticModel:
    return hysteretic(plays(command, output), dynamics(), DT)


def actuator(command: float = 1.0, output: float = 1.0) -> Chain:
    return Chain((DeadTime(jnp.asarray(DT), 10), plays(command, output), dynamics()))


def late(block, delay: float, most: int = 400) -> Chain:
    return Chain((DeadTime(jnp.asarray(delay), most), block))


def around(block, dt: float = DT, substeps: int = 2) -> BlockLoop:
    return BlockLoop(block, quiet(), dt, substeps)


@eqx.filter_jit
def commands(regulator, measured, command=0.0, first=0.0):
    """Commands that follow from measurements, whatever these come from."""

    def one(state, y):
        return regulator.step(state, y)

    return jax.lax.scan(one, regulator.initial(command, first), jnp.asarray(measured))[1]

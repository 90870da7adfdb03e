"""How far a loop is from swinging: margins of gain, phase and delay, from its response to sines."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Int

from .controller import Controller, Regulator
from .loop import Loop, held

_PERIODS = np.unique(np.geomspace(6, 2000, 64).round().astype(int))  # samples
_SETTLED = 1000  # samples, and two periods, before the period that is looked at
_SMALL = 1e-3  # errors that a controller is asked with, by the output's amplitude


class Margins(NamedTuple):
    """inf where nothing of the kind makes the loop swing."""

    gain: float  # by which the loop's gain may grow
    phase: float  # by which it may lag more [rad]; below 0 for a loop that swings as it is
    delay: float  # by which it may be late [s]
    frequency: float  # at which the delay would make it swing [Hz]; NaN without one


def margins(frequency: Float[np.ndarray, "m"], response: Complex[np.ndarray, "m"]) -> Margins:
    r"""From the open loop's response L to errors: it swings where L = -1.

    The gain is the smallest 1/|L| above 1 where the phase is -180 degrees, the phase what it is above that where
    |L| = 1, the delay that phase over $2\pi f$. Between the frequencies log |L| and the phase are straight over log f.
    """
    x, size, phase = np.log(frequency), np.log(np.abs(response)), np.unwrap(np.angle(response))
    turns = (phase + np.pi) / (2 * np.pi)
    wholes = range(int(np.floor(turns.min())), int(np.ceil(turns.max())) + 1)
    gains = [np.exp(-np.interp(at, x, size)) for whole in wholes for at in _crossings(x, turns - whole)]
    ends = [(np.interp(at, x, phase) + np.pi, np.exp(at)) for at in _crossings(x, size)]
    above = [(lag + np.pi) % (2 * np.pi) - np.pi for lag, _ in ends]
    late = [(lag % (2 * np.pi) / (2 * np.pi * f), f) for lag, f in ends]
    delay, at = min(late, default=(np.inf, np.nan))
    gain = min((g for g in gains if g > 1), default=np.inf)
    return Margins(float(gain), float(min(above, key=abs, default=np.inf)), float(delay), float(at))


def open_loop(
    loop: Loop, controller: Controller, amplitude: float
) -> tuple[Float[np.ndarray, "m"], Complex[np.ndarray, "m"]]:
    """Frequencies [Hz] and the response of controller and block one after the other, as they are sampled.

    The block is asked with sines of an amplitude of the command, since hysteresis answers large ones otherwise than
    small ones, the controller about a reference of 0 with errors too small for its limits. First harmonics are taken.
    """
    regulator = controller.planned(np.zeros(2), loop.dt)
    block, law = _responses(loop, regulator, jnp.asarray(amplitude, dtype=float), jnp.asarray(_PERIODS))
    return (1 / (_PERIODS * loop.dt))[::-1], np.asarray(block * law)[::-1]


def _crossings(x: Float[np.ndarray, "m"], y: Float[np.ndarray, "m"]) -> list[float]:
    """Where y, straight between its samples, goes through 0."""
    k = np.flatnonzero(np.sign(y[:-1]) * np.sign(y[1:]) < 0)
    return [float(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])) for i in k]


@eqx.filter_jit
def _responses(
    loop: Loop, regulator: Regulator, amplitude: Array, periods: Int[Array, "m"]
) -> tuple[Complex[Array, "m"], Complex[Array, "m"]]:
    plant = loop.plant.sampled(loop.dt / loop.substeps)

    def answered(state: tuple[Any, Array], u: Array) -> tuple[tuple[Any, Array], Array]:
        inner, output = held(plant, state[0], u, loop.substeps)
        return (inner, output), state[1]  # the output at the time of the command

    def one(period: Array) -> tuple[Array, Array]:
        block = _harmonic(answered, (plant.initial(), jnp.zeros(())), amplitude, period)
        error = _SMALL * amplitude * jnp.abs(block)
        law = _harmonic(lambda state, e: regulator.step(state, -e), regulator.initial(), error, period)
        return block, law

    return jax.lax.map(one, periods)


def _harmonic(step: Any, state: Any, amplitude: Array, period: Array) -> Array:
    """Response at a frequency: the first harmonic of a period, after it has settled."""
    begin = period * -(-_SETTLED // period) + 2 * period

    def sample(k: Array, carry: tuple[Any, Array]) -> tuple[Any, Array]:
        state, total = carry
        angle = 2 * jnp.pi * k / period
        state, y = step(state, amplitude * jnp.sin(angle))
        return state, total + jnp.where(k >= begin, y * jnp.exp(-1j * angle), 0.0)

    return jax.lax.fori_loop(0, begin + period, sample, (state, jnp.zeros((), dtype=complex)))[1] * (
        2j / (amplitude * period)
    )

"""Stability margins of a loop: of gain, phase and delay, from its response to sines."""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Complex, Float, Int

from .block_loop import BlockLoop, hold
from .contract import Controller, Regulator

_PERIODS = np.unique(np.geomspace(3, 2000, 72).round().astype(int))  # samples
_TRANSIENT = 1000  # samples, and two periods, before the period that is evaluated
_SMALL = 1e-3  # error given to a controller, relative to the amplitude of the output


class Margins(NamedTuple):
    """Stability margins; inf where no change of that kind makes the loop unstable.

    Of an unstable loop, the change that would just stabilise it: a gain below 1, phase and delay below 0; 0 and -inf
    where no change of that kind does.
    """

    gain: float  # factor of the loop gain
    phase: float  # additional lag [rad]
    delay: float  # additional delay [s]
    frequency: float  # of the oscillation at the delay margin [Hz]; NaN without one


def margins(frequency: Float[np.ndarray, "m"], response: Complex[np.ndarray, "m"]) -> Margins:
    r"""Margins from the open loop's response L to errors; the limit of stability is L = -1.

    The gain margin is the smallest 1/|L| above 1 where the phase is -180 degrees, the phase margin the phase above that
    where |L| = 1, the delay margin that phase over $2\pi f$. Log |L| and the phase are interpolated over log f.

    A loop is unstable where L encircles -1 (Nyquist; L itself must be stable). A loop whose |L| is still above 1 at the
    highest frequency counts as unstable.
    """
    x, size, phase = np.log(frequency), np.log(np.abs(response)), np.unwrap(np.angle(response))
    phase -= 2 * np.pi * (phase[0] > 0.5 * np.pi)  # it begins at +90 to -270 degrees
    turns = (phase + np.pi) / (2 * np.pi)
    wholes = range(int(np.floor(turns.min())), int(np.ceil(turns.max())) + 1)
    opposed = [(np.interp(at, x, size), sign) for whole in wholes for at, sign in _crossings(x, turns - whole)]
    around = (turns[0] < 0 < size[0]) - sum(sign for s, sign in opposed if s > 0)
    unstable = bool(around > 0 or size[-1] > 0)
    ends = [((np.interp(at, x, phase) + np.pi) % (2 * np.pi), np.exp(at)) for at, _ in _crossings(x, size)]
    lags = [(lag - 2 * np.pi * unstable, f) for lag, f in ends]
    none = -np.inf if unstable else np.inf
    delays = [(lag / (2 * np.pi * f), f) for lag, f in lags]
    delay, at = min(delays, key=lambda x: abs(x[0]), default=(none, np.nan))
    gains = [-s for s, _ in opposed if (s > 0) == unstable]
    gain = np.exp(min(gains, key=abs, default=none))
    return Margins(float(gain), float(min((lag for lag, _ in lags), key=abs, default=none)), float(delay), float(at))


def open_loop(
    loop: BlockLoop, controller: Controller, amplitude: float
) -> tuple[Float[np.ndarray, "m"], Complex[np.ndarray, "m"]]:
    """Frequencies [Hz] and the response of controller and block one after the other, as they are sampled.

    The block gets sines of a given amplitude of the command, since the response of hysteresis depends on it; the
    controller gets errors too small for its limits, about a reference of 0. Only first harmonics count.
    """
    regulator = controller.planned(np.zeros(2), loop.dt)
    block, law = _responses(loop, regulator, jnp.asarray(amplitude, dtype=float), jnp.asarray(_PERIODS))
    return (1 / (_PERIODS * loop.dt))[::-1], np.asarray(block * law)[::-1]


def _crossings(x: Float[np.ndarray, "m"], y: Float[np.ndarray, "m"]) -> list[tuple[float, int]]:
    """Zeros of y, linear between its samples, and whether it rises (1) or falls (-1)."""
    k = np.flatnonzero((y[:-1] < 0) != (y[1:] < 0))
    return [(float(x[i] - y[i] * (x[i + 1] - x[i]) / (y[i + 1] - y[i])), 1 if y[i] < 0 else -1) for i in k]


@eqx.filter_jit
def _responses(
    loop: BlockLoop, regulator: Regulator, amplitude: Array, periods: Int[Array, "m"]
) -> tuple[Complex[Array, "m"], Complex[Array, "m"]]:
    plant = loop.plant.sampled(loop.dt / loop.substeps)

    def response(state: tuple[Any, Array], u: Array) -> tuple[tuple[Any, Array], Array]:
        inner, output = hold(plant, state[0], u, loop.substeps)
        return (inner, output), state[1]  # the output at the time of the command

    def one(period: Array) -> tuple[Array, Array]:
        block = _harmonic(response, (plant.initial(), jnp.zeros(())), amplitude, period)
        error = _SMALL * amplitude * jnp.abs(block)
        law = _harmonic(lambda state, e: regulator.step(state, -e), regulator.initial(), error, period)
        return block, law

    return jax.lax.map(one, periods)


def _harmonic(step: Any, state: Any, amplitude: Array, period: Array) -> Array:
    """Response at a frequency: the first harmonic of a period after the transient."""
    begin = period * -(-_TRANSIENT // period) + 2 * period

    def sample(k: Array, carry: tuple[Any, Array]) -> tuple[Any, Array]:
        state, total = carry
        angle = 2 * jnp.pi * k / period
        state, y = step(state, amplitude * jnp.sin(angle))
        return state, total + jnp.where(k >= begin, y * jnp.exp(-1j * angle), 0.0)

    return jax.lax.fori_loop(0, begin + period, sample, (state, jnp.zeros((), dtype=complex)))[1] * (
        2j / (amplitude * period)
    )

"""Gains from an experiment in which a relay makes the loop swing (Astrom and Hagglund 1984)."""

from itertools import pairwise
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.io import InputError

from .controller import Controller, Regulator

_STEADY = 0.15  # by how much the last swings may differ
_SWINGS = 4  # that are looked at
_ALIKE = 0.05  # by how much the means of these and of as many before may differ, where samples are too few for more


class Relay(Controller):
    """One command or its opposite, by the sign of the error; it turns when the error is beyond a band."""

    amplitude: Float[Array, ""]  # of the command
    band: Float[Array, ""]  # half of it, of the output: more than the noise

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """Along a reference, which is best left at 0."""
        return _Turns(jnp.asarray(reference, dtype=float), self.amplitude, self.band)


class _Turns(Regulator):
    reference: Float[Array, "n"]
    amplitude: Float[Array, ""]
    band: Float[Array, ""]

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> tuple[Array, Array]:
        """Upwards, unless the command was below 0."""
        return jnp.zeros((), dtype=int), jnp.where(jnp.asarray(command) < 0, -self.amplitude, self.amplitude)

    def step(self, state: tuple[Array, Array], measured: Float[Array, ""]) -> tuple[tuple[Array, Array], Array]:
        """The command, turned where the error is beyond the band on the other side."""
        k, command = state
        error = self.reference[jnp.minimum(k, len(self.reference) - 1)] - measured
        turned = jnp.where(error > self.band, self.amplitude, jnp.where(error < -self.band, -self.amplitude, command))
        return (k + 1, turned), turned


class Ultimate(NamedTuple):
    """Where a loop begins to swing under a gain alone."""

    gain: float  # K_u, command per output
    period: float  # T_u [s]

    def pid(self) -> Float[np.ndarray, "3"]:
        """K_p, K_i, K_d by Tyreus and Luyben (1992): K_u/2.2, T_i = 2.2 T_u, T_d = T_u/6.3."""
        kp = self.gain / 2.2
        return np.array([kp, kp / (2.2 * self.period), kp * self.period / 6.3])

    def pi(self) -> Float[np.ndarray, "3"]:
        """The same without a derivative: K_u/3.2, T_i = 2.2 T_u."""
        kp = self.gain / 3.2
        return np.array([kp, kp / (2.2 * self.period), 0.0])


def ultimate(measured: Float[np.ndarray, "n"], command: Float[np.ndarray, "n"], dt: float, band: float) -> Ultimate:
    r"""From the swing under a relay: $K_u = 4 d/(\pi \sqrt{a^2 - \epsilon^2})$ of the amplitudes d of the command and a
    of the output, and the band epsilon.

    Raises InputError where it does not swing evenly within the recording.
    """
    ups = np.flatnonzero((command[1:] > 0) & (command[:-1] < 0)) + 1
    if len(ups) < _SWINGS + 1:
        raise InputError(f"the relay turned up {len(ups)} times; {_SWINGS + 1} are needed. Give it more time.")
    swings = np.array([0.5 * np.ptp(measured[a:b]) for a, b in pairwise(ups[-2 * _SWINGS - 1 :])])
    periods = np.diff(ups[-2 * _SWINGS - 1 :]) * dt
    alike = all(len(x) == 2 * _SWINGS and _alike(x[:_SWINGS], x[_SWINGS:]) for x in (swings, periods))
    last, swings, periods = ups[-_SWINGS - 1 :], swings[-_SWINGS:], periods[-_SWINGS:]
    for what, values in (("amplitudes", swings), ("periods", periods)):
        if not alike and np.ptp(values) > _STEADY * values.mean() + (2 * dt if what == "periods" else 0.0):
            told = ", ".join(f"{x:.3g}" for x in values)
            raise InputError(
                f"the swing is not steady: the last {what} are {told}. Give it more time, or a wider band."
            )
    a, d = float(swings.mean()), float(np.abs(command[last[0] : last[-1]]).max())
    if a <= band:
        raise InputError(f"the output swings by {a:.3g}, within the band of {band:.3g}: the loop does not answer.")
    return Ultimate(4 * d / (np.pi * np.sqrt(a**2 - band**2)), float(periods.mean()))


def _alike(before: Float[np.ndarray, "n"], after: Float[np.ndarray, "n"]) -> bool:
    return bool(abs(after.mean() - before.mean()) <= _ALIKE * after.mean())

"""Feedforward by the inverse of a model: dynamics backwards by derivatives of the reference, then the hysteresis."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.signal import savgol_coeffs

from nectosome.core import RateIndependent
from nectosome.drives import PrandtlIshlinskii, TransferFunction, inverse, respond

from .contract import Controller, Regulator
from .pid import PID


class HystereticModel(eqx.Module):
    """What a feedforward takes an actuator for: hysteresis, dynamics without zeros, and the loop's delay."""

    hysteresis: RateIndependent
    undo: RateIndependent  # its inverse
    dynamics: TransferFunction
    delay: Float[Array, ""]  # from a command to what it does [s]

    def __check_init__(self):
        if self.dynamics.numerator.shape[0] != 1:
            raise ValueError("dynamics with zeros have no inverse made of derivatives alone.")
        if self.dynamics.denominator.shape[0] > 4:
            raise ValueError("dynamics of an order above 3 need derivatives that cubics do not have.")

    def driven(self, wanted: Float[Array, "n"], dt: float, width: float) -> Float[Array, "n"]:
        r"""What the dynamics must be driven with: $v = (a_n r^{(n)} + \dots + a_1 r' + a_0 r)/b_0$.

        Derivatives are those of cubics fitted to `width` [s] around each sample.
        """
        a = self.dynamics.denominator[::-1] / self.dynamics.numerator[0]
        kernels = smoothing(width, dt, a.shape[0] - 1)
        return convolved(jnp.sum(a[:, None] * kernels, axis=0), wanted)

    def command(self, driven: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """The input that drives the dynamics so, sent ahead by the delay and half a sample, for which it is held."""
        return respond(self.undo, self.ahead(driven, dt), dt)

    def ahead(self, x: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """Samples of x from later times, by the delay and half a sample."""
        k = jnp.arange(x.shape[0])
        return jnp.interp(k + self.delay / dt + 0.5, k, x)


def hysteretic(
    hysteresis: PrandtlIshlinskii, dynamics: TransferFunction, delay: Float[ArrayLike, ""]
) -> HystereticModel:
    """A model with the inverse of its hysteresis. Raises InputError where that does not exist."""
    return HystereticModel(hysteresis, inverse(hysteresis), dynamics, jnp.asarray(delay, dtype=float))


class Feedforward(Controller):
    """PID beside the inverse of a model; what the model leaves is the PID's."""

    pid: PID
    model: HystereticModel
    width: float = eqx.field(static=True)  # over which the reference is smoothed [s]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """The model's inverse, along the reference and until it has come to rest where that ends."""
        longer = np.pad(np.asarray(reference, dtype=float), (0, half_window(self.width, dt)), mode="edge")
        driven = self.model.driven(jnp.asarray(longer), dt, self.width)
        return self.pid.fed(longer, self.model.command(driven, dt), dt)


def half_window(width: float, dt: float) -> int:
    """Samples to either side that a smoothed one depends on."""
    return max(round(0.5 * width / dt), 2)


def smoothing(width: float, dt: float, order: int) -> Float[np.ndarray, "order+1 window"]:
    """Kernels that give values and derivatives up to an order, by cubics over a window (Savitzky and Golay 1964)."""
    window = 2 * half_window(width, dt) + 1
    return np.stack([savgol_coeffs(window, 3, deriv=k, delta=dt) for k in range(order + 1)])


def convolved(kernel: Float[ArrayLike, "window"], x: Float[Array, "n"]) -> Float[Array, "n"]:
    """The kernel along x, whose ends go on as they are."""
    half = jnp.asarray(kernel).shape[0] // 2
    return jnp.convolve(jnp.pad(x, half, mode="edge"), jnp.asarray(kernel), mode="valid")

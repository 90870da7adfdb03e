"""The model of an actuator that controllers invert: hysteresis, dynamics and the delay of the loop."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.signal import savgol_coeffs

from nectosome.core import RateIndependent
from nectosome.drives import PrandtlIshlinskii, TransferFunction, inverse, respond

SMOOTHING = 0.08  # s, over which references are smoothed: no actuator tracks a corner exactly


class HystereticModel(eqx.Module):
    """Model of an actuator, for its inverse: hysteresis, dynamics without zeros, and the delay of the loop."""

    hysteresis: RateIndependent
    inverse: RateIndependent  # of the hysteresis
    dynamics: TransferFunction
    delay: Float[Array, ""]  # from a command to its effect [s]

    def __check_init__(self):
        if self.dynamics.numerator.shape[0] != 1:
            raise ValueError("dynamics with zeros have no inverse made of derivatives alone.")
        if self.dynamics.denominator.shape[0] > 4:
            raise ValueError("dynamics of an order above 3 need derivatives that cubics do not have.")

    def dynamics_input(self, reference: Float[Array, "n"], dt: float, width: float) -> Float[Array, "n"]:
        r"""Input of the dynamics for an output that equals the reference: $v = (a_n r^{(n)} + \dots + a_0 r)/b_0$.

        Derivatives are those of cubics fitted to `width` [s] around each sample.
        """
        a = self.dynamics.denominator[::-1] / self.dynamics.numerator[0]
        kernels = smoothing(width, dt, a.shape[0] - 1)
        return convolved(jnp.sum(a[:, None] * kernels, axis=0), reference)

    def command(self, dynamics_input: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """The command that gives this input of the dynamics, sent earlier by the delay and half a hold interval."""
        return respond(self.inverse, self.advanced(dynamics_input, dt), dt)

    def advanced(self, x: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
        """Samples of x from later times, by the delay and half a hold interval."""
        k = jnp.arange(x.shape[0])
        return jnp.interp(k + self.delay / dt + 0.5, k, x)


def hysteretic(
    hysteresis: PrandtlIshlinskii, dynamics: TransferFunction, delay: Float[ArrayLike, ""]
) -> HystereticModel:
    """A model with the inverse of its hysteresis. Raises InputError where that does not exist."""
    return HystereticModel(hysteresis, inverse(hysteresis), dynamics, jnp.asarray(delay, dtype=float))


def half_window(width: float, dt: float) -> int:
    """Samples to either side in the window of a smoothed sample."""
    return max(round(0.5 * width / dt), 2)


def smoothing(width: float, dt: float, order: int) -> Float[np.ndarray, "order+1 window"]:
    """Kernels of values and derivatives up to an order, by cubics over a window (Savitzky and Golay 1964)."""
    window = 2 * half_window(width, dt) + 1
    return np.stack([savgol_coeffs(window, 3, deriv=k, delta=dt) for k in range(order + 1)])


def convolved(kernel: Float[ArrayLike, "window"], x: Float[Array, "n"]) -> Float[Array, "n"]:
    """Convolution of x with a kernel; beyond its ends x is constant."""
    half = jnp.asarray(kernel).shape[0] // 2
    return jnp.convolve(jnp.pad(x, half, mode="edge"), jnp.asarray(kernel), mode="valid")

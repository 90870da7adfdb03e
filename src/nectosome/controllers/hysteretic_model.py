"""The model of an actuator that controllers invert: hysteresis, dynamics and the delay of the loop."""

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float
from scipy.signal import savgol_coeffs

from nectosome.core import RateIndependent
from nectosome.core.tracers import traced
from nectosome.drives import PrandtlIshlinskii, TransferFunction, inverse, respond
from nectosome.units import InputError

_MOST_ORDER = 3  # of dynamics: cubics have no more derivatives
_SETTLED = 3.0  # time constants of a zero's lag that a reference must last
SMOOTHING = 0.08  # s, over which references are smoothed: no actuator tracks a corner exactly


class HystereticModel(eqx.Module):
    """Model of an actuator, for its inverse: hysteresis, dynamics of at most three poles, and the delay of the loop."""

    hysteresis: RateIndependent
    inverse: RateIndependent  # of the hysteresis
    dynamics: TransferFunction
    delay: Float[Array, ""]  # from a command to its effect [s]

    def __check_init__(self):
        order = self.dynamics.denominator.shape[0] - 1
        if order > _MOST_ORDER:
            why = f"has dynamics of order {order}: controllers invert those of order {_MOST_ORDER} at most"
            raise InputError(f"{why}. Identify one with --order {_MOST_ORDER} or less.", field="model")

    def dynamics_input(self, reference: Float[Array, "n"], dt: float, width: float) -> Float[Array, "n"]:
        r"""Input v of the dynamics for an output that equals the reference: $N\,v = a_n r^{(n)} + \dots + a_0 r$.

        Derivatives are those of cubics fitted to `width` [s] around each sample. Without zeros N is $b_0$. One to the
        left is a lag of v. A zero to the right has no inverse that is stable and causal: it is a lag from the end of
        the reference to its begin, so that v begins before the reference does (Devasia, Chen and Paden 1996). Before
        and behind the reference everything rests. Raises InputError for a zero on the imaginary axis, which
        is no lag, and for a reference that changes and is shorter than three time constants of a zero.
        """
        a = self.dynamics.denominator[::-1]
        kernels = smoothing(width, dt, a.shape[0] - 1)
        v = convolved(jnp.sum((a / self.dynamics.numerator[-1])[:, None] * kernels, axis=0), reference)
        if self.dynamics.numerator.shape[0] == 1:
            return v
        constant = not traced(reference) and bool(jnp.all(reference == reference[0]))  # its input is, too
        left, right = _lags(np.asarray(self.dynamics.numerator), np.inf if constant else len(reference) * dt)
        v = _lagged(left, v, dt)
        return _lagged(right, v[::-1], dt)[::-1]

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


def _lags(numerator: Float[np.ndarray, "m+1"], duration: float) -> list[TransferFunction | None]:
    """1/N of gain 1, as a lag of the zeros to the left, and one of those to the right in reversed time."""
    zeros = np.roots(numerator)
    slow = zeros[np.abs(zeros.real) <= _SETTLED / duration]
    if slow.size:
        at = f"{slow[0].real:.3g} /s" if not slow[0].imag else f"{slow[0].real:.3g} +- {abs(slow[0].imag):.3g}i /s"
        why = f"has a zero at {at}: its inverse needs a reference of {_SETTLED:g} of its time constants"
        how = f"this one lasts {duration:.3g} s. Take a longer one, or a model with fewer zeros"
        raise InputError(f"{why}, and {how}.", field="model")
    sides = (zeros[zeros.real < 0], -zeros[zeros.real > 0])
    return [TransferFunction(jnp.ones(1), jnp.asarray(_of_gain_1(side))) if side.size else None for side in sides]


def _of_gain_1(roots: np.ndarray) -> np.ndarray:
    """Coefficients of the polynomial with these roots that is 1 at 0, the highest power first."""
    whole = np.poly(roots).real
    return whole / whole[-1]


def _lagged(lag: TransferFunction | None, x: Float[Array, "n"], dt: float) -> Float[Array, "n"]:
    """Response of a lag of gain 1 that rests before the first sample."""
    return x if lag is None else x[0] + respond(lag, x - x[0], dt)


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

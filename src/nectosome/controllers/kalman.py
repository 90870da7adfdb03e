"""A Kalman filter for samples: states of a linear model, and what disturbs its input, from noisy outputs."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.linalg import solve_discrete_are

from nectosome.drives import TransferFunction
from nectosome.units import InputError


class Sampled(NamedTuple):
    """x' = A x + B u for inputs held over a sample, y = C x."""

    A: Float[np.ndarray, "n n"]
    B: Float[np.ndarray, "n"]
    C: Float[np.ndarray, "n"]


def sampled(dynamics: TransferFunction, dt: float) -> Sampled:
    """Matrices of a transfer function. Raises ValueError for one that answers a jump with a jump."""
    held: Any = dynamics.sampled(dt)
    if float(held.E) != 0.0:
        raise ValueError("the numerator is to be of a lower degree than the denominator.")
    return Sampled(np.asarray(held.A), np.asarray(held.B), np.asarray(held.D))


class KalmanFilter(eqx.Module):
    r"""States and a disturbance w of the input, which wanders: $x' = A x + B (u + w)$, $y = C x + $ noise.

    The gain is the steady one, of the discrete Riccati equation.
    """

    A: Float[Array, "n+1 n+1"]
    B: Float[Array, "n+1"]
    C: Float[Array, "n+1"]
    gain: Float[Array, "n+1"]

    def corrected(self, z: Float[Array, "n+1"], measured: Float[Array, ""]) -> Float[Array, "n+1"]:
        """After a measurement."""
        return z + self.gain * (measured - jnp.sum(self.C * z))

    def predicted(self, z: Float[Array, "n+1"], u: Float[Array, ""]) -> Float[Array, "n+1"]:
        """A sample later."""
        return jnp.sum(self.A * z, axis=1) + self.B * u


def kalman(model: Sampled, wander: float, noise: float) -> KalmanFilter:
    """`wander` is the standard deviation by which the disturbance changes in a sample [input], `noise` that of y.

    Raises InputError where one is not above 0.
    """
    for name, value in (("wander", wander), ("noise", noise)):
        if not value > 0:
            raise InputError(f"is {value:g}; it must be more than 0.", field=name)
    n = len(model.B)
    A = np.block([[model.A, model.B[:, None]], [np.zeros((1, n)), np.ones((1, 1))]])
    C = np.append(model.C, 0.0)
    Q, R = np.diag([0.0] * n + [wander**2]), np.array([[noise**2]])
    P = solve_discrete_are(A.T, C[:, None], Q, R)
    gain = P @ C / (C @ P @ C + noise**2)
    return KalmanFilter(*(jnp.asarray(x) for x in (A, np.append(model.B, 0.0), C, gain)))

"""A discrete Kalman filter: states of a linear model and a disturbance of its input, from noisy outputs."""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.linalg import solve_discrete_are

from nectosome.drives import TransferFunction
from nectosome.units import InputError


class DiscreteModel(NamedTuple):
    """x' = A x + B u with zero-order hold of the input, y = C x."""

    A: Float[np.ndarray, "n n"]
    B: Float[np.ndarray, "n"]
    C: Float[np.ndarray, "n"]


def discrete(dynamics: TransferFunction, dt: float) -> DiscreteModel:
    """Matrices of a transfer function. Raises ValueError for one with feedthrough."""
    linear: Any = dynamics.sampled(dt)
    if float(linear.E) != 0.0:
        raise ValueError("the degree of the numerator must be lower than that of the denominator.")
    return DiscreteModel(np.asarray(linear.A), np.asarray(linear.B), np.asarray(linear.D))


class KalmanFilter(eqx.Module):
    r"""States and a random-walk disturbance w of the input: $x' = A x + B (u + w)$, $y = C x + $ noise.

    The gain is the stationary one, of the discrete Riccati equation.
    """

    A: Float[Array, "n+1 n+1"]
    B: Float[Array, "n+1"]
    C: Float[Array, "n+1"]
    gain: Float[Array, "n+1"]

    def corrected(self, z: Float[Array, "n+1"], measured: Float[Array, ""]) -> Float[Array, "n+1"]:
        """Estimate after a measurement."""
        return z + self.gain * (measured - jnp.sum(self.C * z))

    def predicted(self, z: Float[Array, "n+1"], u: Float[Array, ""]) -> Float[Array, "n+1"]:
        """Estimate one sample later."""
        return jnp.sum(self.A * z, axis=1) + self.B * u


def kalman(model: DiscreteModel, wander: float, noise: float) -> KalmanFilter:
    """Filter for a disturbance with steps of standard deviation `wander` [input] a sample, and `noise` of y.

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

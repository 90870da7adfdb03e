"""The actuator of Table 1, and what it is driven with."""

import warnings

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.drives import Chain, PrandtlIshlinskii, TransferFunction, evenly

BAR, MM = 1e5, 1e-3
LARGEST = 0.6 * BAR  # pressure [Pa], of either sign
WEIGHTS = np.array([992.48, 560.65, -347.35, -27.09, -58.19, 83.87, 89.80, 71.84, 33.05, 71.23])  # c_1 .. c_10
B0 = 5.92
A = 0.59, 22.18, 205.21  # a_2, a_1, a_0 [s, bar, mm]: Table 1 has the first and the last exchanged
FREQUENCY = float(np.sqrt(A[2] / A[0]))  # omega_n [rad/s]
DAMPING = float(A[1] / (2 * np.sqrt(A[0] * A[2])))
GAIN = float(B0 * WEIGHTS.sum() / A[2])  # with all plays moving along [mm/bar]
LIMIT = 3.8 * BAR  # rate at which the valve changes the pressure at most [Pa/s]


def hysteresis() -> PrandtlIshlinskii:
    """Ten plays of 0 to 0.6 bar, from pressure [Pa] to what the dynamics are driven with [m]."""
    weights = B0 / A[2] * WEIGHTS * MM / BAR
    return evenly(weights[1:], LARGEST, weights[0])


def plant(as_printed: bool = False) -> Chain:
    """Displacement of the end [m] by pressure [Pa] (eqs. 2 to 5).

    As printed, with a_0 and a_2 as they stand in Table 1, it follows nothing faster than 0.005 Hz; its gain is kept.
    """
    return Chain((hysteresis(), dynamics(as_printed)))


def dynamics(as_printed: bool = False) -> TransferFunction:
    """Of gain 1 (eq. 4)."""
    if as_printed:
        told = "Table 1 as printed, a0 and a2 exchanged: follows nothing above 0.005 Hz, and the printed PID diverges."
        warnings.warn(told, stacklevel=2)
    a2, a1, a0 = A[::-1] if as_printed else A
    return TransferFunction(jnp.array([a0]), jnp.array([a2, a1, a0]))


def waves(frequency: float, dt: float, count: int = 4, rest: int = 0) -> Float[np.ndarray, "n"]:
    """Pressure of eq. 1 [Pa]: waves of 0.3, 0.4, ... bar, a period each, and then `rest` periods without any.

    The paper prints a remainder by six periods and four waves: six would exceed what the actuator bears.
    """
    t = np.arange(round((count + rest) / frequency / dt) + 1) * dt
    j = np.floor(t * frequency + 1e-9)
    return np.where(j < count, (0.3 + 0.1 * j) * BAR, 0.0) * np.sin(2 * np.pi * (t * frequency - j))

"""The actuator of Table 1, and synthetic recordings of it as the paper's bench would make them: none were published."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Float

from nectosome.drives import Chain, PrandtlIshlinskii, SlewLimit, TransferFunction, evenly, respond
from nectosome.identification.hysteresis.trials import PressureTrial

BAR, MM = 1e5, 1e-3
LARGEST = 0.6 * BAR  # pressure [Pa], of either sign
WEIGHTS = np.array([992.48, 560.65, -347.35, -27.09, -58.19, 83.87, 89.80, 71.84, 33.05, 71.23])  # c_1 .. c_10
B0 = 5.92
# a_2, a_1, a_0 [s, bar, mm]: Table 1 has the first and the last exchanged. As printed the displacement follows nothing
# above 0.005 Hz, and the printed PID diverges.
A = 0.59, 22.18, 205.21
FREQUENCY = float(np.sqrt(A[2] / A[0]))  # omega_n [rad/s]
DAMPING = float(A[1] / (2 * np.sqrt(A[0] * A[2])))
GAIN = float(B0 * WEIGHTS.sum() / A[2])  # with all plays moving along [mm/bar]
LIMIT = 3.8 * BAR  # rate at which the valve changes the pressure at most [Pa/s]
TRAIN = 0.25, 0.5, 0.75, 1.0, 1.25, 1.5  # of recordings [Hz]
HELD_OUT = 0.8, 0.9  # [Hz]
RECORDED_DT = 1e-3  # [s]
NOISE = 5e-5  # of the laser [m]: assumed


def hysteresis() -> PrandtlIshlinskii:
    """Ten plays of 0 to 0.6 bar, from pressure [Pa] to what the dynamics are driven with [m]."""
    weights = B0 / A[2] * WEIGHTS * MM / BAR
    return evenly(weights[1:], LARGEST, weights[0])


def dynamics() -> TransferFunction:
    """Of gain 1 (eq. 4)."""
    return TransferFunction(jnp.array(A[2:]), jnp.array(A))


def plant() -> Chain:
    """Displacement of the end [m] by pressure [Pa] (eqs. 2 to 5)."""
    return Chain((hysteresis(), dynamics()))


def waves(frequency: float, dt: float) -> Float[np.ndarray, "n"]:
    """Pressure of eq. 1 [Pa]: waves of 0.3, 0.4, 0.5 and 0.6 bar, a period each.

    The paper prints a remainder by six periods and four waves: six would exceed the limits of the actuator.
    """
    t = np.arange(round(4 / frequency / dt) + 1) * dt
    j = np.floor(t * frequency + 1e-9)
    return np.where(j < 4, (0.3 + 0.1 * j) * BAR, 0.0) * np.sin(2 * np.pi * (t * frequency - j))


def recorded(frequency: float, seed: int = 0, limit: bool = True) -> PressureTrial:
    """Command and displacement; with `limit` the valve follows commands at 3.8 bar/s at most."""
    command = waves(frequency, RECORDED_DT)
    actuator = Chain((SlewLimit(jnp.asarray(LIMIT)), plant())) if limit else plant()
    rng = np.random.default_rng([seed, round(100 * frequency)])
    displacement = np.asarray(respond(actuator, command, RECORDED_DT)) + NOISE * rng.normal(size=len(command))
    return PressureTrial(f"{frequency:g} Hz", RECORDED_DT, command, displacement)

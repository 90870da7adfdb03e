"""Synthetic recordings of the swimming PoseiDRONE: the paper published none.

The thrust is a strong push of the emptying shell and a weaker pull of the refill:

$$ \\tau = A [e^{4 (\\cos(\\omega t - 0.92 \\pi) - 1)} - \\nu e^{1.2 (\\cos(\\omega t - 1.45 \\pi) - 1)}] $$

Its shape has the ratio of root mean squares of thrust and squared speed that the standard errors of Table 1 stand for,
44.9 kg/m; A and nu are those of a mean speed of 0.08 m/s, which is an assumption: no speed in m/s is printed.
"""

from functools import lru_cache

import numpy as np
from jaxtyping import Float
from scipy.integrate import solve_ivp

from nectosome.description import get_value
from nectosome.identification.surge.estimators import SurgeRecording
from nectosome.robots import describe

OMEGA = {"train": 11.47, "test": 11.76}  # rad/s, of the paper's two recordings
NOISE = 5e-3  # m/s
_AMPLITUDE, _REFILL = 0.7975, 0.3952  # N, -
_SECONDS, _STEP, _THRUST_STEP = 12.0, 0.02, 0.004  # s: of the swim, of the camera, of the load cell
_SETTLED = 60.0  # s, before a recording begins


def body() -> tuple[float, float, float]:
    """Mass M, added mass m_as [kg] and drag Lambda [kg/m] of the robot that ships: those of Table 1."""
    robot = describe("poseidrone_swim")
    area, density = get_value(robot, "body.loads.drag.drag_area.0"), get_value(robot, "water.density")
    return get_value(robot, "body.mass"), get_value(robot, "body.loads.water.mass.0"), 0.5 * density * area


def thrust(phase: Float[np.ndarray, "..."]) -> Float[np.ndarray, "..."]:
    """Thrust forwards [N] at a phase omega t of the crank [rad]."""
    push = np.exp(4 * (np.cos(phase - 0.92 * np.pi) - 1))
    return _AMPLITUDE * (push - _REFILL * np.exp(1.2 * (np.cos(phase - 1.45 * np.pi) - 1)))


@lru_cache
def settled(omega: float) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
    """Times [s] and the speed without noise [m/s] that the body keeps, by an integrator that identifies nothing."""
    mass, added, drag = body()
    time = np.arange(0.0, _SECONDS, _STEP)

    def rate(t: float, v: Float[np.ndarray, "1"]) -> Float[np.ndarray, "1"]:
        return (thrust(np.asarray(omega * t)) - drag * v * np.abs(v)) / (mass + added)

    found = solve_ivp(rate, (-_SETTLED, _SECONDS), [0.08], t_eval=time, rtol=1e-9, atol=1e-12, max_step=0.05)
    return time, found.y[0]


def recording(name: str, rng: np.random.Generator, noise: float = NOISE) -> SurgeRecording:
    """One of `OMEGA` with normal noise on the speed [m/s], and the thrust of a load cell without any."""
    omega = OMEGA[name]
    time, speed = settled(omega)
    own = np.arange(-5 * _THRUST_STEP, _SECONDS + 5 * _THRUST_STEP, _THRUST_STEP)
    title = f"synthetic, {omega:g} rad/s"
    return SurgeRecording(title, time, speed + noise * rng.normal(size=time.size), own, thrust(omega * own))

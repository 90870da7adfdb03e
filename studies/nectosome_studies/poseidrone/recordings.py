r"""Synthetic recordings of the swimming PoseiDRONE, and a chamber for its jet: the paper published neither.

The thrust is a strong push of the emptying shell and a weaker pull of the refill:

$$ \tau(\phi) = A \left[e^{4 (\cos(\phi - 0.92\pi) - 1)} - \nu\, e^{1.2 (\cos(\phi - 1.45\pi) - 1)}\right] $$

Its shape has the ratio of root mean squares of thrust and squared speed that the standard errors of Table 1 stand for,
44.9 kg/m, and suits the crank's angles in Fig. 8; A and $\nu$ are those of a mean speed of 0.08 m/s at
$\omega$ = 11.47 rad/s, which is an assumption: no speed in m/s is printed.
"""

from functools import lru_cache
from typing import NamedTuple

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
EXPELLED = 120e-6  # in a turn (section 2.1) [m3]
_FULL = EXPELLED / 0.34  # [m3]
_DENSITY = 1025.0  # salt water [kg/m3]
_VALUES, _FINE = 72, 200  # of the volume in a turn, and angles between values


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


class JetChamber(NamedTuple):
    """Numbers of a jet's description."""

    volume: Float[np.ndarray, "n"]  # at angles spread evenly over a turn [m3]
    nozzle: float  # [m2]
    inlet: float  # [m2]


def chamber() -> JetChamber:
    r"""Volumes and areas that give the thrust at 11.47 rad/s; it is full where the thrust turns positive.

    With $\tau = \rho Q|Q|/A_n$ while it expels (A_i while it fills), $Q = \pm\sqrt{|\tau| A / \rho}$, and the volume
    expelled in a turn, 34 % of the full chamber, says both areas. The smooth curve through the values gives the thrust
    to 2 % of its peak, its mean and what is expelled to 0.2 %.
    """
    angle = (np.arange(_VALUES * _FINE) + 0.5) * 2 * np.pi / (_VALUES * _FINE)
    tau, time = thrust(angle), 2 * np.pi / (_VALUES * _FINE * OMEGA["train"])
    out, back = np.sqrt(np.maximum(tau, 0.0)), np.sqrt(np.maximum(-tau, 0.0))
    flow = EXPELLED * (out / np.sum(out) - back / np.sum(back))  # in each step
    gone = np.concatenate([[0.0], np.cumsum(flow)])[:-1:_FINE]
    fullest = np.max(np.cumsum(-flow))
    areas = (_DENSITY * (EXPELLED / (np.sum(x) * time)) ** 2 for x in (out, back))
    return JetChamber(_FULL - fullest - gone, *map(float, areas))

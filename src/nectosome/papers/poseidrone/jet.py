r"""A chamber for PoseiDRONE's jet, made to give a thrust that fits what the paper prints. Synthetic, not measured.

The paper's recordings of thrust are not available. What it prints of their use (standard errors, eqs. 6 to 9) and the
crank's angles in Fig. 8 leave for the thrust of the held robot, at $\omega$ = 11.47 rad/s and a mean speed of 0.08 m/s,

$$ \tau(\phi) = A \left[e^{4 (\cos(\phi - 0.92\pi) - 1)} - \nu\, e^{1.2 (\cos(\phi - 1.45\pi) - 1)}\right] $$

with A = 0.7975 N and $\nu$ = 0.3952. With $\tau = \rho Q|Q|/A_n$ while it expels (A_i while it fills),
$Q = \pm\sqrt{|\tau| A / \rho}$, and the volume expelled in a turn, 120 mL, 34 % of the full chamber (section 2.1), says
both areas.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

SPEED = 11.47  # of the crank [rad/s] (section 4.2)
EXPELLED = 120e-6  # [m3]
FULL = EXPELLED / 0.34  # [m3]
DENSITY = 1025.0  # salt water [kg/m3]
_FINE = 200  # angles between values


class JetChamber(NamedTuple):
    """What a jet is described by."""

    volume: Float[np.ndarray, "n"]  # at angles spread evenly over a turn [m3]
    nozzle: float  # [m2]
    inlet: float  # [m2]


def thrust(angle: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Thrust [N] of the held robot at an angle of the crank [rad]."""
    push = np.exp(4.0 * (np.cos(angle - 0.92 * np.pi) - 1))
    return 0.7975 * (push - 0.3952 * np.exp(1.2 * (np.cos(angle - 1.45 * np.pi) - 1)))


def chamber(values: int = 72) -> JetChamber:
    """Volumes and areas that give the thrust at the printed speed; it is full where the thrust turns positive.

    The smooth curve through 72 values gives the thrust to 2 % of its peak, its mean and what is expelled to 0.2 %.
    """
    angle = (np.arange(values * _FINE) + 0.5) * 2 * np.pi / (values * _FINE)
    tau, time = thrust(angle), 2 * np.pi / (values * _FINE * SPEED)
    out, back = np.sqrt(np.maximum(tau, 0.0)), np.sqrt(np.maximum(-tau, 0.0))
    flow = EXPELLED * (out / np.sum(out) - back / np.sum(back))  # in each step
    gone = np.concatenate([[0.0], np.cumsum(flow)])[:-1:_FINE]
    fullest = np.max(np.cumsum(-flow))
    areas = (DENSITY * (EXPELLED / (np.sum(x) * time)) ** 2 for x in (out, back))
    return JetChamber(FULL - fullest - gone, *map(float, areas))

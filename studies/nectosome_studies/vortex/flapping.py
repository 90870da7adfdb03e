r"""Beats of foils: how a foil is shaped, and how it moves over a period while it goes ahead at a speed.

Axes: x along the span, y ahead, z up. The foil's root is at x = 0, its leading edge there at y = 0 on the mean; the
hinge about which it pitches lies behind that. The foil surges, heaves, and turns: it flaps about the root's chord, tip
up, or pitches about the hinge, nose up.
"""

from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.interpolate import CubicSpline

PHASES = 120  # of a beat, evenly spread, at which forces are compared


class Planform(NamedTuple):
    """Edges of a foil, behind its root's leading edge, at places along the span [m]."""

    x: Float[np.ndarray, "n"]
    leading: Float[np.ndarray, "n"]
    trailing: Float[np.ndarray, "n"]

    @property
    def area(self) -> float:
        """Area [m2]."""
        return float(np.trapezoid(self.trailing - self.leading, self.x))


@dataclass(frozen=True)
class FoilBeat:
    """A foil's shape and motion; curves of motion are given at evenly spread phases, the first at 0."""

    planform: Planform
    speed: float  # ahead [m/s]
    frequency: float  # [Hz]
    turn: Literal["flap", "pitch"]
    angle: Float[np.ndarray, "k"]  # [rad]
    heave: Float[np.ndarray, "k"]  # [m]
    surge: Float[np.ndarray, "k"]  # [m]
    density: float  # [kg/m3]
    viscosity: float  # [Pa s]
    hinge: float = 0.0  # of the pitch, behind the root's leading edge [m]
    mirrored: bool = False  # whether its mirror image flaps beside it; forces are of both
    thickness: float = 0.0  # [m]
    bands: tuple[float, ...] = ()  # ends of bands of the span whose lift is compared [m]; none: the whole span

    @property
    def edges(self) -> tuple[float, ...]:
        """Ends of its bands [m]."""
        return self.bands or (0.0, float(self.planform.x[-1]))

    @property
    def aspect_ratio(self) -> float:
        """Span squared over area, with its mirror image."""
        return (1 + self.mirrored) * float(self.planform.x[-1]) ** 2 / self.planform.area


class BeatForces(NamedTuple):
    """Forces of the flow on a foil at `PHASES` of a beat, and what its heave and turn take."""

    lift: Float[np.ndarray, "p band"]  # upwards [N]
    thrust: Float[np.ndarray, "p"]  # ahead [N]
    power: Float[np.ndarray, "p"]  # [W]

    @property
    def total(self) -> Float[np.ndarray, "p"]:
        """Lift of all bands [N]."""
        return self.lift.sum(axis=1)


def periodic_curve(values: Float[np.ndarray, "k *rest"]) -> CubicSpline:
    """Smooth curve over the phase (0 to 1) through values at evenly spread phases."""
    return CubicSpline(np.linspace(0, 1, len(values) + 1), np.concatenate([values, values[:1]]), bc_type="periodic")


def harmonic(values: Float[np.ndarray, "p *rest"]) -> Any:
    r"""First harmonic of values over a beat, c in $Re(c e^{2\pi i t/T})$: complex, or an array of such numbers."""
    phase = np.arange(len(values)) / len(values)
    return 2 * np.tensordot(np.exp(-2j * np.pi * phase), values, axes=1) / len(values)


def rms(values: Float[np.ndarray, "p"]) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))

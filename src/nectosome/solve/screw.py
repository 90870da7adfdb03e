"""Screw motion between two poses: how a swimmer travels and turns in a cycle."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

_NOTHING = 1e-12  # [rad] below, rotation is rounding


class Screw(NamedTuple):
    """A rotation about a line and a translation along it."""

    axis: Float[np.ndarray, "3"]  # direction of the line; without rotation that of the translation, 0 without motion
    point: Float[np.ndarray, "3"]  # of the line, nearest to the origin [m]; NaN without rotation
    angle: float  # of rotation [rad], 0 to pi
    along: float  # translation [m]

    def radius(self, position: Float[np.ndarray, "3"]) -> float:
        """Distance [m] of a position from the line, the radius of its path; inf without rotation."""
        if self.angle == 0:
            return np.inf
        return float(np.linalg.norm(np.cross(self.axis, position - self.point)))


def screw_of(
    start: tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]],
    end: tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "3"]],
) -> Screw:
    r"""Screw motion from one pose (R, p) to another, in the outer frame (Chasles; Murray, Li, Sastry 1994, sec. 2.3).

    The displacement $x \to R x + d$, with $R = R_1 R_0^T = e^{[a]\theta}$ and $d = p_1 - R p_0$, maps to itself the
    line along a through

    $$ c = \tfrac12 \left(d_\perp + \cot\tfrac\theta2\; a \times d_\perp\right), \quad d_\perp = d - (a \cdot d)\, a $$

    A rotation by more than pi appears as the shorter one in the other direction.
    """
    from scipy.spatial.transform import Rotation

    R = end[0] @ start[0].T
    d = end[1] - R @ start[1]
    turn = Rotation.from_matrix(R).as_rotvec()
    angle = float(np.linalg.norm(turn))
    if angle < _NOTHING:
        distance = float(np.linalg.norm(d))
        return Screw(d / distance if distance > 0 else d, np.full(3, np.nan), 0.0, distance)
    axis = turn / angle
    along = float(axis @ d)
    across = d - along * axis
    return Screw(axis, 0.5 * (across + np.cross(axis, across) / np.tan(0.5 * angle)), angle, along)

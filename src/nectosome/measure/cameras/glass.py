r"""A flat pane between a camera in air and what it sees in water (Treibitz et al., IEEE TPAMI 34 (2012) 51).

A ray that makes an angle $\theta$ with the pane's normal in the air goes on, by Snell's law, at
$\tan\theta_i = \tau / \sqrt{m_i^2 + (m_i^2 - 1)\tau^2}$, $\tau = \tan\theta$, with $m_i$ the index of glass or water.
It comes by a point at a depth b behind the pane and to the side by L where

$$ F(\tau) = a \tau + T \tan\theta_g + b \tan\theta_w - L = 0 $$

with a the distance of the camera from the pane and T its thickness.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

_STEPS = 50
_SETTLED = 1e-15


@dataclass(frozen=True, eq=False)
class Glass:
    """A pane: a `point` of the face towards the air [m], its normal in either direction, thickness [m], indices [-].

    The index of the air is 1. Raises ValueError for a normal without length, a thickness below 0, an index below 1.
    """

    point: Float[np.ndarray, "3"]
    normal: Float[np.ndarray, "3"]
    thickness: float = 0.0
    glass: float = 1.52
    water: float = 1.333

    def __post_init__(self) -> None:
        point, normal = np.asarray(self.point, float), np.asarray(self.normal, float)
        length = float(np.linalg.norm(normal))
        if not (np.isfinite(point).all() and np.isfinite(length) and length > 0):
            raise ValueError(f"Glass: point {point.tolist()} and normal {normal.tolist()} are no plane.")
        if not (self.thickness >= 0 and self.glass >= 1 and self.water >= 1):
            raise ValueError(
                f"Glass: thickness is {self.thickness:g} m (0 or more), the indices {self.glass:g} and {self.water:g} "
                "(1 or more)."
            )
        object.__setattr__(self, "point", point)
        object.__setattr__(self, "normal", normal / length)

    def apparent(
        self, centre: Float[np.ndarray, "3"], points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3 3"]]:
        r"""Where points in the water seem to be from a camera's centre, as deep as they are, and the derivatives.

        $$ x' = c + h n + h \frac{\tau}{L} l, \quad h = n \cdot (x - c), \quad l = x - c - h n, \quad L = |l| $$

        A camera without the pane sees x' where this one sees x. NaN for points that are not behind the pane.
        """
        n = self.normal
        a = float((self.point - centre) @ n)
        n, a = (n, a) if a > 0 else (-n, -a)
        away = np.asarray(points, float) - centre
        h = away @ n
        side = away - h[:, None] * n
        L = np.linalg.norm(side, axis=1)
        b = np.where(h - a - self.thickness >= 0, h - a - self.thickness, np.nan)
        tau, slope, water = self._tangent(a, b, L)
        straight = 1 / (a + self.thickness / self.glass + b / self.water)  # tau / L of a ray along the normal
        near = 1e-9 * np.abs(h) > L
        wide = np.where(near, 1.0, L)
        ratio = np.where(near, straight, tau / wide)
        by_side = np.where(near, 0.0, (1 / slope - ratio) / wide)  # of the ratio by L, and by the depth
        by_depth = np.where(near, -(straight**2) / self.water, -water / slope / wide)
        seen = centre + h[:, None] * n + (h * ratio)[:, None] * side
        across = np.eye(3) - np.outer(n, n)
        toward = side / wide[:, None]
        rise = (by_side * h)[:, None, None] * side[:, :, None] * toward[:, None, :]
        deep = ((by_depth * h + ratio)[:, None] * side + n)[:, :, None] * n
        return seen, rise + deep + (h * ratio)[:, None, None] * across

    def _tangent(
        self, a: float, b: Float[np.ndarray, "n"], L: Float[np.ndarray, "n"]
    ) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Tangent tau of the angle in the air, dF/dtau [m], and the tangent in the water, by Newton's method.

        F rises and bends down, so that steps from below the root never pass it.
        """
        tau = L / np.maximum(a + self.thickness + np.nan_to_num(b), 1e-300)
        slope, water = np.ones_like(L), np.zeros_like(L)
        for _ in range(_STEPS):
            left, slope = a * tau - L, np.full_like(L, a)
            for length, m in ((self.thickness, self.glass), (b, self.water)):
                root = np.sqrt(m * m + (m * m - 1) * tau * tau)
                left, slope = left + length * tau / root, slope + length * m * m / root**3
                water = tau / root
            step = left / slope
            tau = tau - step
            if not np.any(np.abs(step) > _SETTLED * (1 + tau)):
                break
        return tau, slope, water

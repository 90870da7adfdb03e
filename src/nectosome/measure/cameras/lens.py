"""What a lens does to straight lines, in OpenCV's terms (Brown, Photogrammetric Engineering 32 (1966) 444)."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from .small import zeros

_STEPS = 60  # of Newton's method, which needs four to eight where there is a solution


@dataclass(frozen=True, eq=False)
class Lens:
    r"""Distortion of a lens, as OpenCV's calibration with a chessboard gives it.

    With $(x, y, 1) = K^{-1} (u, v, 1)$ of a straight pixel and $r^2 = x^2 + y^2$, the pixel that is seen is K times

    $$ x' = x\,(1 + k_1 r^2 + k_2 r^4 + k_3 r^6) + 2 p_1 x y + p_2 (r^2 + 2 x^2) $$
    $$ y' = y\,(1 + k_1 r^2 + k_2 r^4 + k_3 r^6) + p_1 (r^2 + 2 y^2) + 2 p_2 x y $$

    (OpenCV, "Camera calibration and 3D reconstruction"). Raises ValueError for a K that is not upper triangular with
    focal lengths above 0 and 1 in its corner, and for coefficients that are not five finite numbers.
    """

    intrinsics: Float[np.ndarray, "3 3"]  # K [px]: focal lengths, skew (0 in OpenCV), centre
    distortion: Float[np.ndarray, "5"]  # k1, k2, p1, p2, k3 [-]

    def __post_init__(self) -> None:
        K, d = np.asarray(self.intrinsics, float), np.asarray(self.distortion, float)
        upper = K.shape == (3, 3) and np.isfinite(K).all() and not np.tril(K, -1).any()
        if not (upper and K[0, 0] > 0 and K[1, 1] > 0 and K[2, 2] == 1):
            raise ValueError(
                f"Lens: intrinsics are {K.tolist()}, and [[fx, s, cx], [0, fy, cy], [0, 0, 1]] is expected."
            )
        if d.shape != (5,) or not np.isfinite(d).all():
            raise ValueError(f"Lens: distortion is {d.tolist()}, and five numbers k1, k2, p1, p2, k3 are expected.")
        object.__setattr__(self, "intrinsics", K)
        object.__setattr__(self, "distortion", d)

    def bent(
        self, pixels: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"], Float[np.ndarray, "n"]]:
        """Pixels that are seen of straight ones, their derivatives, and whether the lens shows them (above 0).

        Far from the centre the polynomials turn back: what lies there is not seen, wherever they put it.
        """
        return bent(self.intrinsics, self.distortion, pixels)

    def straightened(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Straight pixels of those that are seen, by Newton's method; NaN where the lens shows nothing there."""
        scale, centre = self.intrinsics[:2, :2], self.intrinsics[:2, 2]
        seen = (np.asarray(pixels, float) - centre) @ np.linalg.inv(scale).T
        x = seen.copy()
        todo = np.flatnonzero(np.isfinite(seen).all(axis=1))
        for _ in range(_STEPS):
            out, slope, _ = _brown(x[todo], self.distortion)
            left = seen[todo] - out
            a, b, c, d = slope[:, 0, 0], slope[:, 0, 1], slope[:, 1, 0], slope[:, 1, 1]
            det = a * d - b * c
            turned = np.stack([d * left[:, 0] - b * left[:, 1], a * left[:, 1] - c * left[:, 0]], axis=1)
            step = turned / np.where(np.abs(det) > 1e-3, det, 1e-3)[:, None]
            step *= np.minimum(1, 0.5 / np.maximum(_size(step), 1e-300))[:, None]
            x[todo] += step
            todo = todo[_size(step) > 1e-15 * (1 + _size(x[todo]))]
            if not len(todo):
                break
        out, _, shown = _brown(x, self.distortion)
        x[~((shown > 0) & (_size(out - seen) < 1e-12 * (1 + _size(seen))))] = np.nan
        return x @ scale.T + centre


def bent(
    K: Float[np.ndarray, "3 3"], distortion: Float[np.ndarray, "5"], pixels: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"], Float[np.ndarray, "n"]]:
    """What `Lens.bent` returns, of numbers that may still be wrong."""
    scale, centre = K[:2, :2], K[:2, 2]
    inverse = np.linalg.inv(scale)
    out, slope, shown = _brown((pixels - centre) @ inverse.T, distortion)
    by_pixels = inverse.T @ np.tensordot(scale, np.moveaxis(slope, 0, -1), 1)
    return out @ scale.T + centre, np.moveaxis(by_pixels, -1, 0), shown


def _size(xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n"]:
    """The larger coordinate."""
    return np.maximum(np.abs(xy[:, 0]), np.abs(xy[:, 1]))


def _brown(
    xy: Float[np.ndarray, "n 2"], distortion: Float[np.ndarray, "5"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"], Float[np.ndarray, "n"]]:
    """Bent x, y, their derivatives, and the smaller of the radial factor and the derivatives' determinant."""
    k1, k2, p1, p2, k3 = distortion
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    rise = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # d radial / dx = rise x
    out = np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
        axis=1,
    )
    slope = zeros(len(xy), 2, 2)
    slope[:, 0, 0] = radial + rise * x * x + 2 * p1 * y + 6 * p2 * x
    slope[:, 0, 1] = slope[:, 1, 0] = rise * x * y + 2 * p1 * x + 2 * p2 * y
    slope[:, 1, 1] = radial + rise * y * y + 6 * p1 * y + 2 * p2 * x
    return out, slope, np.minimum(radial, slope[:, 0, 0] * slope[:, 1, 1] - slope[:, 0, 1] ** 2)

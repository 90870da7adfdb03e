r"""Camera model: a projection matrix from the world to pixels, the distortion of its lens, and a flat pane of glass.

The world is right-handed, in metres, z up; pixels are (u, v), u to the right, v down, from the centre of the first
pixel. Pixels are those of the file, with the lens's distortion, unless named "straight" (undistorted).
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

_STEPS = 60  # of Newton's method; four to eight suffice if there is a solution
_NEWTON_STEPS = 50
_TOLERANCE = 1e-15


def inverse(a: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Inverses by cofactors; NaN or inf for singular matrices."""
    cofactors = np.cross(a[:, [1, 2, 0]], a[:, [2, 0, 1]])
    with np.errstate(divide="ignore", invalid="ignore"):
        return cofactors.transpose(0, 2, 1) / np.sum(a[:, 0] * cofactors[:, 0], axis=1)[:, None, None]


@dataclass(frozen=True, eq=False)
class Lens:
    r"""Lens distortion by Brown's model, as in OpenCV.

    With $(x, y, 1) = K^{-1} (u, v, 1)$ of a straight pixel and $r^2 = x^2 + y^2$, the distorted pixel is K times

    $$ x' = x\,(1 + k_1 r^2 + k_2 r^4 + k_3 r^6) + 2 p_1 x y + p_2 (r^2 + 2 x^2) $$
    $$ y' = y\,(1 + k_1 r^2 + k_2 r^4 + k_3 r^6) + p_1 (r^2 + 2 y^2) + 2 p_2 x y $$

    (OpenCV, "Camera calibration and 3D reconstruction"). Raises ValueError for a K that is not upper triangular with
    positive focal lengths and a last element of 1, and unless there are five finite coefficients.
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

    def distort(
        self, pixels: Float[np.ndarray, "n 2"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"], Float[np.ndarray, "n"]]:
        """Distorted pixels of straight ones, their Jacobian, and visibility (above 0: visible).

        Far from the centre the polynomials fold back; points there are not visible.
        """
        scale, centre = self.intrinsics[:2, :2], self.intrinsics[:2, 2]
        back = np.linalg.inv(scale)
        out, jacobian, shown = _brown((pixels - centre) @ back.T, self.distortion)
        return out @ scale.T + centre, scale @ jacobian @ back, shown

    def undistort(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Straight pixels of distorted ones, by Newton's method; NaN outside the image of the lens."""
        scale, centre = self.intrinsics[:2, :2], self.intrinsics[:2, 2]
        seen = (np.asarray(pixels, float) - centre) @ np.linalg.inv(scale).T
        x = seen.copy()
        todo = np.flatnonzero(np.isfinite(seen).all(axis=1))
        for _ in range(_STEPS):
            out, jacobian, _ = _brown(x[todo], self.distortion)
            r = seen[todo] - out
            a, b, c, d = jacobian[:, 0, 0], jacobian[:, 0, 1], jacobian[:, 1, 0], jacobian[:, 1, 1]
            det = a * d - b * c
            turned = np.stack([d * r[:, 0] - b * r[:, 1], a * r[:, 1] - c * r[:, 0]], axis=1)
            step = turned / np.where(np.abs(det) > 1e-3, det, 1e-3)[:, None]
            step *= np.minimum(1, 0.5 / np.maximum(_size(step), 1e-300))[:, None]
            x[todo] += step
            todo = todo[_size(step) > 1e-15 * (1 + _size(x[todo]))]
            if not len(todo):
                break
        out, _, shown = _brown(x, self.distortion)
        x[~((shown > 0) & (_size(out - seen) < 1e-12 * (1 + _size(seen))))] = np.nan
        return x @ scale.T + centre


def _size(xy: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n"]:
    """The larger coordinate."""
    return np.maximum(np.abs(xy[:, 0]), np.abs(xy[:, 1]))


def _brown(
    xy: Float[np.ndarray, "n 2"], distortion: Float[np.ndarray, "5"]
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 2"], Float[np.ndarray, "n"]]:
    """Distorted x, y, their Jacobian, and the smaller one of the radial factor and the Jacobian's determinant."""
    k1, k2, p1, p2, k3 = distortion
    x, y = xy[:, 0], xy[:, 1]
    r2 = x * x + y * y
    radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3))
    rise = 2 * (k1 + r2 * (2 * k2 + r2 * 3 * k3))  # d radial / dx = rise x
    out = np.stack(
        [x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x), y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y],
        axis=1,
    )
    jacobian = np.empty((len(xy), 2, 2))
    jacobian[:, 0, 0] = radial + rise * x * x + 2 * p1 * y + 6 * p2 * x
    jacobian[:, 0, 1] = jacobian[:, 1, 0] = rise * x * y + 2 * p1 * x + 2 * p2 * y
    jacobian[:, 1, 1] = radial + rise * y * y + 6 * p1 * y + 2 * p2 * x
    return out, jacobian, np.minimum(radial, jacobian[:, 0, 0] * jacobian[:, 1, 1] - jacobian[:, 0, 1] ** 2)


@dataclass(frozen=True, eq=False)
class Glass:
    """A flat pane: a `point` on its face towards the air [m], its normal (either sign), thickness [m], indices [-].

    The refractive index of air is 1. Raises ValueError for a zero normal, a negative thickness, an index below 1.
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
            raise ValueError(f"Glass: point {point.tolist()} and normal {normal.tolist()} define no plane.")
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
        r"""Apparent positions, from a camera's centre, of points in the water, and their Jacobian.

        $$ x' = c + h n + h \frac{\tau}{L} l, \quad h = n \cdot (x - c), \quad l = x - c - h n, \quad L = |l| $$

        x' has the depth of x. A camera without the pane sees x' at the pixel of x. NaN for points not behind the pane.
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
        by_side = np.where(near, 0.0, (1 / slope - ratio) / wide)  # derivatives of the ratio by L, and by the depth
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

        F is increasing and concave, so that steps from below the root do not overshoot.
        """
        tau = L / np.maximum(a + self.thickness + np.nan_to_num(b), 1e-300)
        slope, water = np.ones_like(L), np.zeros_like(L)
        for _ in range(_NEWTON_STEPS):
            left, slope = a * tau - L, np.full_like(L, a)
            for length, m in ((self.thickness, self.glass), (b, self.water)):
                root = np.sqrt(m * m + (m * m - 1) * tau * tau)
                left, slope = left + length * tau / root, slope + length * m * m / root**3
                water = tau / root
            step = left / slope
            tau = tau - step
            if not np.any(np.abs(step) > _TOLERANCE * (1 + tau)):
                break
        return tau, slope, water


@dataclass(frozen=True, eq=False)
class Report:
    """Quality of a calibration."""

    rms: float  # [px] reprojection error
    residual: Float[np.ndarray, "n 2"]  # [px], measured - projected
    sd: float  # [px] of one measured coordinate: sqrt(sum of squares / freedom)
    freedom: int  # degrees of freedom: equations - unknowns
    condition: float  # largest over smallest singular value of the linear equations, after normalisation
    place_se: float  # [m/px]: standard error across the view, at the centroid of the points, per px of sd
    covariance: Float[np.ndarray, "p p"]  # of the matrix, row by row, then the lens's estimated coefficients
    notes: tuple[str, ...]  # methods and cautions


@dataclass(frozen=True, eq=False)
class Camera:
    r"""Projection of the world's points to the picture:

    $$ w\,(u, v, 1)^T = P\,(x, y, z, 1)^T $$ for straight pixels, then the lens.

    P is scaled so that w is the depth in front of the camera [m]: the first three elements of its last row have norm 1,
    and the determinant of its first three columns is positive. Raises ValueError for a matrix that cannot be scaled so.
    """

    matrix: Float[np.ndarray, "3 4"]
    lens: Lens | None = None
    size: tuple[int, int] | None = None  # width, height of the picture [px]
    report: Report | None = None  # None: not calibrated here
    glass: Glass | None = None  # a pane between the camera and the points; P is then of rays in the air

    def __post_init__(self) -> None:
        P = np.asarray(self.matrix, float)
        if P.shape != (3, 4) or not np.isfinite(P).all():
            raise ValueError(f"Camera: a matrix of 3 x 4 finite numbers is expected, and there is {P.tolist()}.")
        singular = np.linalg.svd(P[:, :3], compute_uv=False)
        if singular[2] <= 1e-14 * singular[0]:
            raise ValueError("Camera: the first three columns of the matrix are singular: it has no centre.")
        P = P / (np.linalg.norm(P[2, :3]) * np.sign(np.linalg.det(P[:, :3] / singular[0])))
        object.__setattr__(self, "matrix", P)

    @property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Centre of projection in the world [m]; with refraction, the apparent one."""
        return -np.linalg.solve(self.matrix[:, :3], self.matrix[:, 3])

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Pixels of points [m]; NaN for points behind the camera or outside the image of its lens."""
        pixels, _, depth = self.project_with_jacobian(points)
        pixels[~(depth > 0)] = np.nan
        return pixels

    def project_with_jacobian(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 3"], Float[np.ndarray, "n"]]:
        """Pixels of points, their Jacobian [px/m], and depth [m] (not positive: not visible)."""
        if self.glass is not None:
            seen, by_point = self.glass.apparent(self.centre, points)
            pixels, jacobian, depth = replace(self, glass=None).project_with_jacobian(seen)
            return pixels, jacobian @ by_point, np.where(np.isfinite(depth), depth, -1.0)
        M = self.matrix[:, :3]
        h = M @ np.asarray(points, float).T + self.matrix[:, 3:]
        depth = h[2]
        w = np.where(depth == 0, np.nan, depth)
        straight = h[:2] / w
        jacobian = np.moveaxis((M[:2, :, None] - straight[:, None] * M[2, :, None]) / w, -1, 0)
        if self.lens is None:
            return straight.T, jacobian, depth
        pixels, by_straight, shown = self.lens.distort(straight.T)
        return pixels, by_straight @ jacobian, np.where(shown > 0, depth, np.minimum(depth, 0))

    def undistort(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Pixels without distortion; NaN outside the image of the lens."""
        return np.array(pixels, float) if self.lens is None else self.lens.undistort(pixels)

    def depth(self, points: Float[np.ndarray, "*batch 3"]) -> Float[np.ndarray, "*batch"]:
        """Depth of points in front of the camera, along its axis [m]."""
        return np.asarray(points, float) @ self.matrix[2, :3] + self.matrix[2, 3]

r"""A camera as eleven numbers: a matrix from the world to pixels, and what its lens does to straight lines.

The world is right-handed, in metres, z up; pixels are (u, v), u to the right, v down, counted from the middle of the
first one. Pixels are those of the file, with the lens's distortion, unless "straight" is said.
"""

from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from .glass import Glass
from .lens import Lens
from .small import times


@dataclass(frozen=True, eq=False)
class Report:
    """How a camera was calibrated, and how well."""

    rms: float  # [px] of the distances between where the points are read and where the camera puts them
    residual: Float[np.ndarray, "n 2"]  # [px], read less put
    sd: float  # [px] of one coordinate of a reading: sqrt(sum of squares / freedom)
    freedom: int  # equations less unknowns
    condition: float  # largest over smallest singular value of the linear equations, after normalisation
    place_se: float  # [m/px]: standard error across the view, in the middle of the points, per px of sd
    covariance: Float[np.ndarray, "p p"]  # of the matrix, row by row, then the lens's estimated coefficients
    notes: tuple[str, ...]  # what was done, and what to keep in mind


@dataclass(frozen=True, eq=False)
class Camera:
    r"""Where the world's points are in the picture:

    $$ w\,(u, v, 1)^T = P\,(x, y, z, 1)^T $$ for straight pixels, then the lens.

    P is scaled so that w is the depth in front of the camera [m]: the first three numbers of its last row have length
    1, and the determinant of its first three columns is above 0. Raises ValueError where that cannot be.
    """

    matrix: Float[np.ndarray, "3 4"]
    lens: Lens | None = None
    size: tuple[int, int] | None = None  # width, height of the picture [px]
    report: Report | None = None  # None: it was not calibrated here
    glass: Glass | None = None  # a pane between the camera and the points; P is then of rays in the air

    def __post_init__(self) -> None:
        P = np.asarray(self.matrix, float)
        if P.shape != (3, 4) or not np.isfinite(P).all():
            raise ValueError(f"Camera: a matrix of 3 x 4 finite numbers is expected, and there is {P.tolist()}.")
        singular = np.linalg.svd(P[:, :3], compute_uv=False)
        if singular[2] <= 1e-14 * singular[0]:
            raise ValueError("Camera: the first three columns of the matrix have no inverse: it has no place.")
        P = P / (np.linalg.norm(P[2, :3]) * np.sign(np.linalg.det(P[:, :3] / singular[0])))
        object.__setattr__(self, "matrix", P)

    @property
    def centre(self) -> Float[np.ndarray, "3"]:
        """Place of the camera in the world [m], through which all rays go; with refraction, where they seem to meet."""
        return -np.linalg.solve(self.matrix[:, :3], self.matrix[:, 3])

    def project(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 2"]:
        """Pixels of points [m]; NaN for what is behind the camera or too far aside for its lens."""
        pixels, _, depth = self.projected(points)
        pixels[~(depth > 0)] = np.nan
        return pixels

    def projected(
        self, points: Float[np.ndarray, "n 3"]
    ) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 3"], Float[np.ndarray, "n"]]:
        """Pixels of points, their derivatives [px/m], and depth [m]; not above 0: they are not seen."""
        if self.glass is not None:
            seen, seem = self.glass.apparent(self.centre, points)
            pixels, slope, depth = replace(self, glass=None).projected(seen)
            return pixels, times(slope, seem), np.where(np.isfinite(depth), depth, -1.0)
        M = self.matrix[:, :3]
        h = M @ np.asarray(points, float).T + self.matrix[:, 3:]
        depth = h[2]
        w = np.where(depth == 0, np.nan, depth)
        straight = h[:2] / w
        slope = np.moveaxis((M[:2, :, None] - straight[:, None] * M[2, :, None]) / w, -1, 0)
        if self.lens is None:
            return straight.T, slope, depth
        pixels, bend, shown = self.lens.bent(straight.T)
        return pixels, times(bend, slope), np.where(shown > 0, depth, np.minimum(depth, 0))

    def straightened(self, pixels: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Pixels as a lens without distortion would show them; NaN where the lens shows nothing."""
        return np.array(pixels, float) if self.lens is None else self.lens.straightened(pixels)

    def depth(self, points: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n"]:
        """How far in front of the camera points are, along its axis [m]."""
        return np.asarray(points, float) @ self.matrix[2, :3] + self.matrix[2, 3]

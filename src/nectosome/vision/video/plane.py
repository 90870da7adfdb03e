"""Mapping of pixels to positions in the plane of motion, by a scale or by known points, with lens distortion.

x points to the right of the picture, y up (camera above) or down (camera below), so that angles about the vertical are
positive counter-clockwise, seen from above. Pixels are counted from the centre of the first one.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nectosome.io.extras import package
from nectosome.units import InputError
from nectosome.vision.cameras import Lens

from .sheet import SegmentSheet, SheetPlace

_FAR = 3.0  # [px] residual above which a known point is misread


@dataclass(frozen=True)
class MotionPlane:
    """Positions of pixels in the plane of motion."""

    grid: Float[np.ndarray, "height width 2"]  # x, y of each pixel's centre [`unit`]
    unit: str  # m, or px without a scale
    pixel: float  # side of a pixel in the middle of the picture [`unit`]
    residual: float | None  # [px] rms residual of known points; None without any
    to_pixels: Float[np.ndarray, "3 3"]  # homography from positions to undistorted pixels
    lens: Lens | None

    def pixels(self, places: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
        """Pixels of positions."""
        straight = _mapped(self.to_pixels, places)
        return straight if self.lens is None else self.lens.distort(straight)[0]


def plane_of(sheet: SegmentSheet, size: tuple[int, int]) -> MotionPlane:
    """Plane of a picture of `size` (width, height) [px]. Raises InputError for points that do not fit."""
    width, height = size
    lens, residual = sheet.lens.build() if sheet.lens is not None else None, None
    if sheet.points is not None:
        to_pixels, residual = _homography(sheet.points, lens)
        unit = "m"
    else:
        scale = sheet.pixel if sheet.pixel is not None else 1.0
        u, v = _straight(np.array([sheet.origin or (0.0, height - 1.0)], float), lens)[0]
        down = -1.0 if sheet.seen_from == "above" else 1.0
        to_pixels = np.array([[1 / scale, 0, u], [0, down / scale, v], [0, 0, 1.0]])
        unit = "m" if sheet.pixel is not None else "px"
    pixels = np.stack(np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float)), -1)
    seen = _straight(pixels.reshape(-1, 2), lens)
    grid = _mapped(np.linalg.inv(to_pixels), seen).reshape(height, width, 2)
    a, b = height // 2, width // 2
    across, down = grid[a, b] - grid[a, b - 1], grid[a, b] - grid[a - 1, b]
    pixel = float(np.sqrt(abs(across[0] * down[1] - across[1] * down[0])))
    return MotionPlane(grid, unit, pixel, residual, to_pixels, lens)


def _straight(pixels: Float[np.ndarray, "n 2"], lens: Lens | None) -> Float[np.ndarray, "n 2"]:
    return pixels if lens is None else lens.undistort(pixels)


def _mapped(matrix: Float[np.ndarray, "3 3"], points: Float[np.ndarray, "n 2"]) -> Float[np.ndarray, "n 2"]:
    mapped = np.column_stack([points, np.ones(len(points))]) @ matrix.T
    return mapped[:, :2] / mapped[:, 2:]


def _homography(points: tuple[SheetPlace, ...], lens: Lens | None) -> tuple[Float[np.ndarray, "3 3"], float]:
    """Homography from positions to pixels by least squares, and the rms residual of the points [px]."""
    seen = _straight(np.array([point.seen for point in points], float), lens)
    places = np.array([point.at for point in points], float)
    for what, known in (("at", places), ("seen", seen)):
        spread = np.linalg.svd(known - known.mean(0), compute_uv=False)
        if spread[1] < 0.02 * spread[0]:
            raise InputError(
                f"lie on a line ({what}): nothing is known across it. Choose points around the motion.", field="points"
            )
    scale = np.ptp(places)  # better conditioned
    matrix, _ = package("cv2", "video").findHomography(places / scale, seen, 0)
    if matrix is None or abs(np.linalg.det(matrix)) < 1e-9:
        raise InputError("three of four lie on a line: choose points around the motion.", field="points")
    to_pixels = matrix @ np.diag([1 / scale, 1 / scale, 1.0])
    off = np.linalg.norm(_mapped(to_pixels, places) - seen, axis=1)
    if off.max() > _FAR:
        worst = int(np.argmax(off))
        raise InputError(
            f"does not fit the others: it is {off[worst]:.1f} px off. Check its pixel, its position and their signs.",
            field=f"points.{worst}",
        )
    return to_pixels, float(np.sqrt(np.mean(off**2)))

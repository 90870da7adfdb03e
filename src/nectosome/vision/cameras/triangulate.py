"""Triangulation: positions from the pixels of several cameras, with standard errors."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from jaxtyping import Float, Int8

from nectosome.units.errors import ReasonedStatus

from .camera import Camera, inverse

_STEPS = 20
_TOLERANCE = 1e-10  # last step over the distance from the cameras; the next one would be far smaller
_ENOUGH = 1e-6  # largest last step of a valid position over the distance from the cameras


class PlaceStatus(ReasonedStatus):
    """Status of a position or a pose; 0: valid."""

    GOOD = 0, "good"
    FEW_CAMERAS = 1, "seen by fewer than two cameras"
    PARALLEL = 2, "its rays are nearly parallel"
    BEHIND = 3, "its rays meet behind a camera"
    NOT_CONVERGED = 4, "its rays do not meet"
    FEW_MARKERS = 5, "fewer than three markers have a position"
    LINE = 6, "the markers with a position lie on a line"
    GIMBAL = 7, "pitch is near 90 deg: roll and yaw are not separable, the rotation is valid"


@dataclass(frozen=True, eq=False)
class Triangulated:
    """Positions of points in the world; invalid ones are NaN, with the reason in `status`."""

    place: Float[np.ndarray, "*batch 3"]  # [m]
    residual: Float[np.ndarray, "*batch"]  # [px] rms reprojection error over the cameras
    covariance: Float[np.ndarray, "*batch 3 3"]  # [m2]
    status: Int8[np.ndarray, "*batch"]  # a `PlaceStatus`

    @property
    def se(self) -> Float[np.ndarray, "*batch 3"]:
        """Standard errors of x, y, z [m]."""
        return np.sqrt(np.diagonal(self.covariance, axis1=-2, axis2=-1))


def triangulate(
    cameras: Sequence[Camera],
    pixels: Float[np.ndarray, "cameras *batch 2"],
    *,
    sd_px: float | Float[np.ndarray, "cameras"],
    least_angle: float = np.radians(1.0),
) -> Triangulated:
    r"""Positions that minimise $\sum |measured - projected|^2 / sd^2$ over the cameras, by Gauss-Newton.

    The start is the linear solution. Pixels are those of the file, with the lens's distortion; NaN: not visible in that
    camera. `sd_px` is the standard error of one coordinate of a pixel, for all cameras or one each; cov = (J^T J /
    sd^2)^-1 (Hartley & Zisserman 2004, sections 5.2.3 and 12.2), without the calibration's errors, which are constant
    over all frames. A wrong match in one camera shows in the residual, unless it lies on the epipolar line.

    The position is NaN, with a status, for fewer than two cameras, rays that meet behind a camera or not at all, and no
    two rays that differ by `least_angle` [rad]. Raises ValueError for shapes that do not match and errors that are not
    positive.
    """
    pixels = np.asarray(pixels, float)
    if pixels.ndim < 2 or len(pixels) != len(cameras) or pixels.shape[-1] != 2:
        raise ValueError(
            f"triangulate: pixels are {pixels.shape}, and [cameras, ..., 2] is expected, of {len(cameras)} cameras."
        )
    sd = np.asarray(sd_px, float)
    if sd.shape not in ((), (len(cameras),)) or not ((sd > 0) & (sd < np.inf)).all():
        raise ValueError(f"triangulate: sd_px is {sd.tolist()}; one positive number, or one a camera, is expected.")
    if not 0 < least_angle < np.pi / 2:
        raise ValueError(f"triangulate: least_angle is {least_angle:g} rad; it must be between 0 and pi/2.")
    batch = pixels.shape[1:-1]
    read = pixels.reshape(len(cameras), -1, 2)
    straight = np.stack([camera.undistort(p) for camera, p in zip(cameras, read, strict=True)])
    weight = np.isfinite(straight).all(axis=-1) / np.broadcast_to(sd[..., None], (len(cameras), 1)) ** 2
    status = np.full(read.shape[1], PlaceStatus.GOOD, np.int8)
    status[np.count_nonzero(weight, axis=0) < 2] = PlaceStatus.FEW_CAMERAS
    status[(status == PlaceStatus.GOOD) & (_angle(cameras, straight) < least_angle)] = PlaceStatus.PARALLEL
    place, residual = np.full((len(status), 3), np.nan), np.full(len(status), np.nan)
    covariance = np.full((len(status), 3, 3), np.nan)
    todo = np.flatnonzero(status == PlaceStatus.GOOD)
    if len(todo):
        chosen = read[:, todo], weight[:, todo]
        x = _linear(cameras, straight[:, todo], chosen[1])
        with np.errstate(all="ignore"):  # diverging points
            x, converged = _refined(cameras, *chosen, x)
            normal, _, squares, depth = _equations(cameras, *chosen, x)
        status[todo[~converged]] = PlaceStatus.NOT_CONVERGED
        status[todo[converged & (np.where(chosen[1] > 0, depth, 1) <= 0).any(axis=0)]] = PlaceStatus.BEHIND
        good = status[todo] == PlaceStatus.GOOD
        place[todo[good]], covariance[todo[good]] = x[good], inverse(normal[good])
        residual[todo[good]] = np.sqrt(squares[good] / np.count_nonzero(chosen[1][:, good], axis=0))
    return Triangulated(
        place.reshape(*batch, 3), residual.reshape(batch), covariance.reshape(*batch, 3, 3), status.reshape(batch)
    )


def _angle(cameras: Sequence[Camera], straight: Float[np.ndarray, "c n 2"]) -> Float[np.ndarray, "n"]:
    """Largest angle between two rays [rad], at most pi/2; 0 without two rays."""
    rays = []
    for camera, pixels in zip(cameras, straight, strict=True):
        ends = np.column_stack([pixels, np.ones(len(pixels))]) @ np.linalg.inv(camera.matrix[:, :3]).T
        rays.append(ends / np.linalg.norm(ends, axis=1, keepdims=True))
    sine = np.zeros(straight.shape[1])
    for a, b in combinations(rays, 2):
        sine = np.fmax(sine, np.linalg.norm(np.cross(a, b), axis=1))
    return np.arcsin(np.minimum(sine, 1))


def _linear(
    cameras: Sequence[Camera], straight: Float[np.ndarray, "c n 2"], weight: Float[np.ndarray, "c n"]
) -> Float[np.ndarray, "n 3"]:
    """Linear least squares of (m_1 - u m_3) (x, 1) = 0, (m_2 - v m_3) (x, 1) = 0, m_i the matrix's rows."""
    about = np.mean([camera.centre for camera in cameras], axis=0)
    P = np.stack([camera.matrix for camera in cameras])[:, None]
    start = P @ np.array([*about, 1.0])
    pixels = np.where(weight[..., None] > 0, straight, 0)
    rows = P[:, :, :2, :3] - pixels[..., None] * P[:, :, 2:, :3]
    normal, right = _normal_equations(rows, pixels * start[..., 2:] - start[..., :2], weight)
    return np.einsum("nij,nj->ni", inverse(normal), right) + about


def _refined(
    cameras: Sequence[Camera],
    read: Float[np.ndarray, "c n 2"],
    weight: Float[np.ndarray, "c n"],
    x: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3"], np.ndarray]:
    """Positions after Gauss-Newton, and whether it converged."""
    x = x.copy()
    last = np.full(len(x), np.inf)
    todo = np.arange(len(x))
    for _ in range(_STEPS):
        normal, right, _, depth = _equations(cameras, read[:, todo], weight[:, todo], x[todo])
        step = np.einsum("nij,nj->ni", inverse(normal), right)
        x[todo] += step
        last[todo] = np.linalg.norm(step, axis=1) / np.abs(depth).max(axis=0)
        todo = todo[last[todo] > _TOLERANCE]
        if not len(todo):
            break
    return x, last < _ENOUGH


def _equations(
    cameras: Sequence[Camera],
    read: Float[np.ndarray, "c n 2"],
    weight: Float[np.ndarray, "c n"],
    x: Float[np.ndarray, "n 3"],
) -> tuple[Float[np.ndarray, "n 3 3"], Float[np.ndarray, "n 3"], Float[np.ndarray, "n"], Float[np.ndarray, "c n"]]:
    """J^T W J, J^T W (measured - projected), the sum of |measured - projected|^2 [px^2], and depths."""
    each = zip(*(camera.project_with_jacobian(x) for camera in cameras), strict=True)
    projected, jacobian, depths = map(np.stack, each)
    residual = np.where(weight[..., None] > 0, read - projected, 0)
    return *_normal_equations(jacobian, residual, weight), np.sum(residual**2, axis=(0, 2)), depths


def _normal_equations(
    rows: Float[np.ndarray, "c n 2 3"], values: Float[np.ndarray, "c n 2"], weight: Float[np.ndarray, "c n"]
) -> tuple[Float[np.ndarray, "n 3 3"], Float[np.ndarray, "n 3"]]:
    """A^T W A and A^T W b of the equations rows . x = values of all cameras."""
    weighted = rows * weight[..., None, None]
    return (weighted.transpose(0, 1, 3, 2) @ rows).sum(axis=0), np.einsum("cnki,cnk->ni", weighted, values)

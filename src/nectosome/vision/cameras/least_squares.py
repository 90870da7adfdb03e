"""Least-squares fit of a camera to measured pixels, started from the linear solution."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from nectosome.io.extras import package

from .camera import Camera, Lens

_EXACT: Any = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15) | {"method": "lm", "x_scale": "jac", "max_nfev": 300}
_SINGULAR = 1e-9  # singular value ratio of a matrix; cameras have more than 1e-4


def normaliser(x: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d+1 d+1"]:
    """Shift and scale to centroid 0 and mean square distance d (Hartley, PAMI 19 (1997) 580)."""
    middle = x.mean(axis=0)
    scale = np.sqrt(x.shape[1] / np.mean(np.sum((x - middle) ** 2, axis=1)))
    out = np.diag([*np.full(x.shape[1], scale), 1.0])
    out[:-1, -1] = -scale * middle
    return out


def transformed(matrix: Float[np.ndarray, "d1 d1"], x: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    """Points after shift and scale."""
    return x @ matrix[:-1, :-1].T + matrix[:-1, -1]


def linear(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, "3 4"], float]:
    r"""Matrix P of norm 1 that minimises $\sum |p_1 X - u\,p_3 X|^2 + |p_2 X - v\,p_3 X|^2$, X = (x, y, z, 1).

    Also returns the condition number of the equations: their largest over their second smallest singular value.
    Abdel-Aziz & Karara, Symposium on Close-Range Photogrammetry (1971), as in Hartley & Zisserman (2004), algorithm
    7.1, for normalised points and pixels.
    """
    X = np.column_stack([points, np.ones(len(points))])
    rows = np.zeros((len(X), 2, 3, 4))
    rows[:, 0, 0] = rows[:, 1, 1] = X
    rows[:, :, 2] = -pixels[:, :, None] * X[:, None]
    _, singular, V = np.linalg.svd(rows.reshape(-1, 12), full_matrices=False)
    return V[11].reshape(3, 4), float(singular[0] / max(singular[10], 1e-300))


@dataclass(frozen=True, eq=False)
class CameraFit:
    """A camera, and the statistics of its least-squares fit."""

    camera: Camera
    residual: Float[np.ndarray, "n 2"]  # [px], measured - projected
    leverage: Float[np.ndarray, "n 2 2"]  # derivative of the projected pixel by the measured one
    covariance: Float[np.ndarray, "p p"]  # of the matrix, row by row, and the lens, for errors of 1 px
    middle: Float[np.ndarray, "2 2"]  # covariance of the pixel of the points' centroid, for errors of 1 px
    condition: float  # of the linear equations: largest over second smallest singular value
    determined: float  # smallest over largest singular value of the Jacobian with columns of norm 1

    @property
    def squares(self) -> float:
        """Sum of squared residuals [px^2]."""
        return float(np.sum(self.residual**2))


def fit(
    points: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    lens: Lens | None = None,
    terms: int = 0,
    starts: Sequence[float] = (0.0,),
) -> CameraFit:
    r"""Minimise sum |measured - projected|^2 over P (Hartley & Zisserman 2004, algorithm 7.1) and `terms` of k1, k2.

    P = K [R | t], K with a skew: eleven parameters (`project`), which OpenCV's own `calibrateCamera` does not have. An
    estimated lens has the K of P and `terms` coefficients, the best fit of several `starts` (k1 r^2 of the outermost
    pixel [-]). If the best fit is not a camera (random pixels), the linear solution is returned.
    """
    middle = points.mean(axis=0)
    X = points - middle
    last: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}  # scipy evaluates residuals and Jacobian separately

    def model(p: Float[np.ndarray, "p"]) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m p"]]:
        key = p.tobytes()
        if key not in last:
            last.clear()
            at, jacobian = project(p, X, lens)
            last[key] = (at - pixels).ravel(), jacobian.reshape(-1, len(p))
        return last[key]

    begins, condition = _starts(X, pixels, lens, terms, starts)
    jacobian: Any = lambda p: model(p)[1]  # noqa: E731
    with np.errstate(all="ignore"):
        least, best = np.inf, begins[0]
        for begin in begins:
            found = least_squares(lambda p: model(p)[0], begin, jacobian, **_EXACT)
            if found.cost < least and _is_camera(found.x, *model(found.x)):
                least, best = found.cost, found.x
    left, derivatives = model(best)
    P, by_parameters = _matrix(best[:11], middle)
    # parameters of the tangent plane of |P| = 1, normalised: well-conditioned for cameras far away, too
    S, T = normaliser(points), normaliser(pixels)
    normalised = (T @ P @ np.linalg.inv(S)).reshape(1, 12)
    chart = np.linalg.svd(normalised)[2][1:] @ np.kron(T, np.linalg.inv(S).T) @ by_parameters
    to_own = np.eye(len(best))
    to_own[:11, :11] = np.linalg.inv(chart / np.linalg.norm(normalised))
    derivatives = derivatives @ to_own
    length = np.linalg.norm(derivatives, axis=0)
    U, d, V = np.linalg.svd(derivatives / length, full_matrices=False)
    whitened = to_own @ (V.T / np.maximum(d, 1e-16 * d[0]) / length[:, None])
    root = np.concatenate([by_parameters @ whitened[:11], whitened[11:]])
    at_middle = project(best, np.zeros((1, 3)), lens)[1][0] @ whitened
    parts = U.reshape(len(X), 2, -1)
    if terms:
        K = _intrinsics(best)
        lens = Lens(K * np.sign(np.diag(K)), np.pad(best[11:], (0, 5 - terms)))
    return CameraFit(
        Camera(P, lens),
        -left.reshape(-1, 2),
        parts @ parts.transpose(0, 2, 1),
        root @ root.T,
        at_middle @ at_middle.T,
        condition,
        d[-1] / d[0],
    )


def project(
    p: Float[np.ndarray, "p"], X: Float[np.ndarray, "n 3"], lens: Lens | None = None
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 p"]]:
    """Pixels, and their derivatives by fx, skew, fy, cx, cy, the rotation vector, the translation, k1, k2."""
    rotation, shift, terms = p[5:8], p[8:11], len(p) - 11
    coefficients = np.pad(p[11:], (0, 5 - terms))
    at, jacobian = package("cv2", "video").projectPoints(X, rotation, shift, np.eye(3), coefficients)
    at, jacobian = at.reshape(-1, 2), jacobian.reshape(len(X), 2, -1)  # by rotation, shift, focal, centre, lens
    scale = np.array([[p[0], p[1]], [0.0, p[2]]])
    pixels = at @ scale.T + p[3:5]
    by_K = np.zeros((len(X), 2, 5))
    by_K[:, 0, :2], by_K[:, 1, 2] = at, at[:, 1]
    by_K[:, 0, 3] = by_K[:, 1, 4] = 1.0
    out = np.concatenate([by_K, scale @ jacobian[..., :6], scale @ jacobian[..., 10 : 10 + terms]], axis=2)
    if lens is None:
        return pixels, out
    pixels, by_straight, _ = lens.distort(pixels)
    return pixels, by_straight @ out


def _starts(
    X: Float[np.ndarray, "n 3"],
    pixels: Float[np.ndarray, "n 2"],
    lens: Lens | None,
    terms: int,
    starts: Sequence[float],
) -> tuple[list[Float[np.ndarray, "p"]], float]:
    """Initial parameters, linear solutions of pixels straightened by each k1; condition of the linear equations."""
    straight = pixels if lens is None else lens.undistort(pixels)
    first, condition = _linear_parameters(X, straight)
    out = [np.append(first, np.zeros(terms))]
    for start in starts if terms else ():
        K = _intrinsics(first)
        ends = (straight - K[:2, 2]) @ np.linalg.inv(K[:2, :2]).T
        k1 = start / np.max(np.sum(ends**2, axis=1))
        other = Lens(K, np.array([k1, 0, 0, 0, 0])).undistort(straight)
        if k1 and np.isfinite(other).all():
            out.append(np.concatenate([_linear_parameters(X, other)[0], [k1], np.zeros(terms - 1)]))
    return out, condition


def _linear_parameters(X: Float[np.ndarray, "n 3"], straight: Float[np.ndarray, "n 2"]) -> tuple[np.ndarray, float]:
    """Parameters of the linear camera, and the condition number of its equations."""
    cv2 = package("cv2", "video")
    S, T = normaliser(X), normaliser(straight)
    matrix, condition = linear(transformed(S, X), transformed(T, straight))
    P = np.linalg.inv(T) @ matrix @ S
    K, R, centre = cv2.decomposeProjectionMatrix(P * np.copysign(1.0, np.linalg.det(P[:, :3])))[:3]
    shift = -R @ centre[:3, 0] / centre[3]
    return np.concatenate([K[[0, 0, 1, 0, 1], [0, 1, 1, 2, 2]] / K[2, 2], cv2.Rodrigues(R)[0][:, 0], shift]), condition


def _matrix(p: Float[np.ndarray, "p"], middle: Float[np.ndarray, "3"]) -> tuple[np.ndarray, Float[np.ndarray, "12 11"]]:
    """P = K [R | t - R m] of points less m, and its derivatives by the parameters, but for the lens."""
    K = _intrinsics(p)
    R, by_rotation = package("cv2", "video").Rodrigues(p[5:8])
    out = np.zeros((11, 3, 4))
    rays = np.column_stack([R, p[8:11] - R @ middle])
    for k, (i, j) in enumerate(((0, 0), (0, 1), (1, 1), (0, 2), (1, 2))):
        out[k, i] = rays[j]
    turned = K @ by_rotation.reshape(3, 3, 3)
    out[5:8] = np.concatenate([turned, -(turned @ middle)[..., None]], axis=2)
    out[8:11, :, 3] = K.T
    return K @ rays, out.reshape(11, 12).T


def _intrinsics(p: Float[np.ndarray, "p"]) -> Float[np.ndarray, "3 3"]:
    return np.array([[p[0], p[1], p[3]], [0, p[2], p[4]], [0, 0, 1]])


def _is_camera(p: Float[np.ndarray, "p"], *derived: np.ndarray) -> bool:
    """Whether focal lengths are not 0 and all derived values are finite."""
    return bool(abs(p[[0, 2]]).min() > _SINGULAR * abs(p[[0, 2]]).max() and all(np.isfinite(x).all() for x in derived))

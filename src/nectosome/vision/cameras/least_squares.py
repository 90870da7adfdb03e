"""Least-squares fit of a camera to measured pixels, started from the linear solution."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float
from scipy.optimize import least_squares

from .camera import Camera, Lens, distort

_EXACT: Any = dict.fromkeys(("xtol", "ftol", "gtol"), 1e-15)
_STEPS = 100  # 5 to 30 for correct readings
_SINGULAR = 1e-9  # singular value ratio of a normalised matrix; cameras have more than 1e-4


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


def intrinsics(
    matrix: Float[np.ndarray, "3 4"],
) -> tuple[Float[np.ndarray, "3 3"], Float[np.ndarray, "12 3 3"]]:
    r"""K of P = K [R | t], upper triangular with positive focal lengths, and its derivatives by the elements of P.

    With rows $m_i$ of P's first three columns, $K K^T = W$, $W_{ij} = m_i \cdot m_j / |m_3|^2$ (Hartley & Zisserman
    2004, section 6.2.4): $W_{13} = c_x$, $W_{23} = c_y$, $f_y^2 = W_{22} - c_y^2$, $s f_y = W_{12} - c_x c_y$,
    $f_x^2 = W_{11} - c_x^2 - s^2$.
    """
    M = matrix[:, :3]
    dM = np.eye(12).reshape(12, 3, 4)[:, :, :3]
    square = M[2] @ M[2]
    W = M @ M.T / square
    dW = dM @ M.T
    dW = (dW + dW.transpose(0, 2, 1)) / square - (2 * dM[:, 2] @ M[2] / square)[:, None, None] * W
    cx, cy = W[0, 2], W[1, 2]
    dcx, dcy = dW[:, 0, 2], dW[:, 1, 2]
    fy = np.sqrt(W[1, 1] - cy**2)
    dfy = (dW[:, 1, 1] - 2 * cy * dcy) / (2 * fy)
    s = (W[0, 1] - cx * cy) / fy
    ds = (dW[:, 0, 1] - cx * dcy - cy * dcx - s * dfy) / fy
    fx = np.sqrt(W[0, 0] - cx**2 - s**2)
    dfx = (dW[:, 0, 0] - 2 * cx * dcx - 2 * s * ds) / (2 * fx)
    dK = np.zeros((12, 3, 3))
    dK[:, 0, 0], dK[:, 0, 1], dK[:, 0, 2], dK[:, 1, 1], dK[:, 1, 2] = dfx, ds, dcx, dfy, dcy
    return np.array([[fx, s, cx], [0, fy, cy], [0, 0, 1]]), dK


@dataclass(frozen=True, eq=False)
class CameraFit:
    """A camera, and the statistics of its least-squares fit."""

    camera: Camera
    residual: Float[np.ndarray, "n 2"]  # [px], measured - projected
    leverage: Float[np.ndarray, "n 2 2"]  # derivative of the projected pixel by the measured one
    covariance: Float[np.ndarray, "p p"]  # of the matrix, row by row, and the lens, for errors of 1 px
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

    P varies in the tangent plane of the sphere |P| = 1 at the linear solution: eleven parameters. An estimated lens has
    the K of P and `terms` coefficients, the best fit of several `starts` (k1 r^2 of the outermost pixel [-]). Data are
    normalised, derivatives exact. If the best fit is not a camera (random pixels), the linear solution is returned.
    """
    S = normaliser(points)
    straight = pixels if lens is None else lens.undistort(pixels)
    T = normaliser(straight)
    X, seen = transformed(S, points), transformed(T, pixels)
    start, condition = linear(X, transformed(T, straight))
    chart = np.linalg.svd(start.reshape(1, 12))[2][1:].T
    own = None if lens is None else Lens(_upper(T @ lens.intrinsics), lens.distortion)
    X1 = np.column_stack([X, np.ones(len(X))])

    last: dict[bytes, tuple[np.ndarray, np.ndarray]] = {}  # scipy evaluates residuals and Jacobian separately

    def model(p: Float[np.ndarray, "p"]) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m p"]]:
        key = p.tobytes()
        if key in last:
            return last[key]
        last.clear()
        at, by_matrix, by_lens = project_normalised((start.ravel() + chart @ p[:11]).reshape(3, 4), p[11:], X1, own)
        derivatives = np.concatenate([by_matrix @ chart, by_lens], axis=2).reshape(at.size, -1)
        return last.setdefault(key, ((at - seen).ravel(), derivatives))

    jacobian: Any = lambda p: model(p)[1]  # noqa: E731
    with np.errstate(all="ignore"):
        least, best = np.inf, np.zeros(11 + terms)
        for begin in _starts(start, chart, X, transformed(T, straight), terms, starts):
            found = least_squares(lambda p: model(p)[0], begin, jacobian, method="lm", max_nfev=_STEPS, **_EXACT)
            matrix = (start.ravel() + chart @ found.x[:11]).reshape(3, 4)
            if found.cost < least and _is_camera(matrix, *model(found.x)):
                least, best = found.cost, found.x
    left, derivatives = model(best)
    scale = T[0, 0]
    length = np.linalg.norm(derivatives, axis=0)
    U, d, V = np.linalg.svd(derivatives / length, full_matrices=False)
    whitened = (V.T / np.maximum(d, 1e-16 * d[0])) / length[:, None] * scale
    matrix = (start.ravel() + chart @ best[:11]).reshape(3, 4)
    camera, carry = _denormalised(matrix, best[11:], T, S, lens)
    carry = np.block([[carry @ chart, np.zeros((12, terms))], [np.zeros((terms, 11)), np.eye(terms)]]) @ whitened
    parts = U.reshape(len(X), 2, -1)
    return CameraFit(
        camera, -left.reshape(-1, 2) / scale, parts @ parts.transpose(0, 2, 1), carry @ carry.T, condition, d[-1] / d[0]
    )


def _starts(
    matrix: Float[np.ndarray, "3 4"],
    chart: Float[np.ndarray, "12 11"],
    X: Float[np.ndarray, "n 3"],
    seen: Float[np.ndarray, "n 2"],
    terms: int,
    starts: Sequence[float],
) -> Iterator[Float[np.ndarray, "p"]]:
    """Initial parameters: linear solutions of pixels undistorted by lenses with the first K and each k1."""
    for start in starts if terms else (0.0,):
        begin = np.zeros(11 + terms)
        if start:
            K, _ = intrinsics(matrix)
            ends = (np.column_stack([seen, np.ones(len(seen))]) @ np.linalg.inv(K).T)[:, :2]
            begin[11] = start / np.max(np.sum(ends**2, axis=1))
            straight = Lens(_upper(K), _distortion(begin[11:12])).undistort(seen)
            if np.isnan(straight).any():
                continue
            other = linear(X, straight)[0].ravel()
            begin[:11] = chart.T @ other / (matrix.ravel() @ other)
        yield begin


def _is_camera(matrix: Float[np.ndarray, "3 4"], *derived: np.ndarray) -> bool:
    """Whether a matrix has a centre of projection and all derived values are finite."""
    d = np.linalg.svd(matrix[:, :3], compute_uv=False)
    return bool(d[2] > _SINGULAR * d[0] and all(np.isfinite(x).all() for x in derived))


def project_normalised(
    matrix: Float[np.ndarray, "3 4"], terms: Float[np.ndarray, "k"], X: Float[np.ndarray, "n 4"], lens: Lens | None
) -> tuple[Float[np.ndarray, "n 2"], Float[np.ndarray, "n 2 12"], Float[np.ndarray, "n 2 k"]]:
    """Pixels, and their derivatives by the matrix and by the lens coefficients."""
    h = X @ matrix.T
    straight = h[:, :2] / h[:, 2:]
    near = X / h[:, 2:]
    by_matrix = np.zeros((len(X), 2, 3, 4))
    by_matrix[:, 0, 0] = by_matrix[:, 1, 1] = near
    by_matrix[:, :, 2] = -straight[:, :, None] * near[:, None]
    by_matrix = by_matrix.reshape(-1, 2, 12)
    if lens is not None:
        at, by_straight, _ = lens.distort(straight)
        return at, by_straight @ by_matrix, np.empty((len(X), 2, 0))
    if not len(terms):
        return straight, by_matrix, np.empty((len(X), 2, 0))
    K, dK = intrinsics(matrix)
    at, by_straight, _ = distort(K, _distortion(terms), straight)
    scale, centre = K[:2, :2], K[:2, 2]
    before, after = (np.linalg.solve(scale, (x - centre).T).T for x in (straight, at))
    # at = A b(A^-1 (q - c)) + c: A and c of K vary as well as q
    aside = np.einsum("kij,nj->nik", dK[:, :2, :2], after) + dK[:, :2, 2].T
    through = np.einsum("kij,nj->nik", dK[:, :2, :2], before) + dK[:, :2, 2].T
    r2 = np.sum(before**2, axis=1)
    powers = r2[:, None] ** np.arange(1, len(terms) + 1)
    return at, by_straight @ (by_matrix - through) + aside, (before @ scale.T)[:, :, None] * powers[:, None]


def _denormalised(
    matrix: Float[np.ndarray, "3 4"],
    terms: Float[np.ndarray, "k"],
    T: Float[np.ndarray, "3 3"],
    S: Float[np.ndarray, "4 4"],
    lens: Lens | None,
) -> tuple[Camera, Float[np.ndarray, "12 12"]]:
    """Camera of a normalised matrix, and derivatives of its matrix by the normalised one."""
    back = np.linalg.inv(T)
    P = back @ matrix @ S
    if len(terms):
        lens = Lens(_upper(back @ intrinsics(matrix)[0]), _distortion(terms))
    camera = Camera(P, lens)
    factor = camera.matrix[2, :3] @ P[2, :3] / (P[2, :3] @ P[2, :3])
    carry = factor * np.kron(back, S.T)
    last = np.zeros(12)
    last[8:11] = camera.matrix[2, :3]
    return camera, carry - np.outer(camera.matrix.ravel(), last @ carry)


def _distortion(terms: Float[np.ndarray, "k"]) -> Float[np.ndarray, "5"]:
    return np.pad(terms, (0, 5 - len(terms)))


def _upper(K: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """K without rounding errors below its diagonal."""
    K = np.triu(K)
    return K / K[2, 2]

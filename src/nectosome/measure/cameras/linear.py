"""The direct linear transformation: a camera's matrix from known points, by a singular value decomposition."""

import numpy as np
from jaxtyping import Float


def normaliser(x: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "d+1 d+1"]:
    """Shift and scale that put points around 0 at a mean square distance of d (Hartley, PAMI 19 (1997) 580)."""
    middle = x.mean(axis=0)
    scale = np.sqrt(x.shape[1] / np.mean(np.sum((x - middle) ** 2, axis=1)))
    out = np.diag([*np.full(x.shape[1], scale), 1.0])
    out[:-1, -1] = -scale * middle
    return out


def moved(matrix: Float[np.ndarray, "d1 d1"], x: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    """Points after a shift and a scale."""
    return x @ matrix[:-1, :-1].T + matrix[:-1, -1]


def linear(
    points: Float[np.ndarray, "n 3"], pixels: Float[np.ndarray, "n 2"]
) -> tuple[Float[np.ndarray, "3 4"], float]:
    r"""Matrix P of length 1 for which $\sum |p_1 X - u\,p_3 X|^2 + |p_2 X - v\,p_3 X|^2$ is least, X = (x, y, z, 1).

    Returns also the condition of the equations, the largest over the smallest but one of their singular values.
    Abdel-Aziz & Karara, Symposium on Close-Range Photogrammetry (1971), as in Hartley & Zisserman (2004), algorithm
    7.1, of points and pixels that were normalised.
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
    r"""K of P = K [R | t], upper triangular, its focal lengths above 0, and its derivatives by P's numbers.

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

"""Many small matrices at once, stored with their number last: arithmetic on one element of all is quick."""

import numpy as np
from jaxtyping import Float


def zeros(n: int, *shape: int) -> Float[np.ndarray, "n *shape"]:
    """Zeros [n, *shape], of which each element of all n lies together."""
    return np.moveaxis(np.zeros((*shape, n)), -1, 0)


def inverse(a: Float[np.ndarray, "n 3 3"]) -> Float[np.ndarray, "n 3 3"]:
    """Inverses of symmetric matrices by cofactors; NaN or inf where there is none."""
    xx, yy, zz, xy, xz, yz = a[:, 0, 0], a[:, 1, 1], a[:, 2, 2], a[:, 0, 1], a[:, 0, 2], a[:, 1, 2]
    out = zeros(len(a), 3, 3)
    out[:, 0, 0] = yy * zz - yz * yz
    out[:, 0, 1] = out[:, 1, 0] = xz * yz - xy * zz
    out[:, 0, 2] = out[:, 2, 0] = xy * yz - xz * yy
    out[:, 1, 1] = xx * zz - xz * xz
    out[:, 1, 2] = out[:, 2, 1] = xy * xz - xx * yz
    out[:, 2, 2] = xx * yy - xy * xy
    det = xx * out[:, 0, 0] + xy * out[:, 0, 1] + xz * out[:, 0, 2]
    with np.errstate(divide="ignore", invalid="ignore"):
        out /= det[:, None, None]
    return out


def times(a: Float[np.ndarray, "n k m"], b: Float[np.ndarray, "n m l"]) -> Float[np.ndarray, "n k l"]:
    """Products of matrices."""
    out = zeros(len(a), a.shape[1], b.shape[2])
    for i in range(a.shape[1]):
        for j in range(b.shape[2]):
            for k in range(a.shape[2]):
                out[:, i, j] += a[:, i, k] * b[:, k, j]
    return out


def apply(a: Float[np.ndarray, "n k m"], x: Float[np.ndarray, "n m"]) -> Float[np.ndarray, "n k"]:
    """Products of matrices and vectors."""
    return times(a, x[:, :, None])[:, :, 0]

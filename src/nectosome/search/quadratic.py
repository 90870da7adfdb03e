"""Small convex quadratic programs, as they arise in sequential quadratic programming."""

import numpy as np
from jaxtyping import Float
from scipy.linalg import cholesky, solve_triangular
from scipy.optimize import nnls

_FAR = 1e-14  # squared residual of an inconsistent program: its solution would be 1e7 times farther than need be
_NONE = 1e-200  # a row of A as long, or shorter, has no direction


def minimise_quadratic(
    B: Float[np.ndarray, "n n"],
    c: Float[np.ndarray, "n"],
    A: Float[np.ndarray, "k n"],
    b: Float[np.ndarray, "k"],
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "k"]] | None:
    r"""Minimise \( c^T d + d^T B d / 2 \) with \( A d \le b \), B positive definite.

    As a least distance problem, solved by non-negative least squares (Lawson and Hanson 1974, chapter 23). Returns d
    and the multipliers (>= 0) of the rows of A, or None where no d fits them.
    """
    L = cholesky(B, lower=True)
    shift = solve_triangular(L, c, lower=True)
    # with z = L^T d + shift: minimise |z| subject to G z >= h, rows of G of length one
    G = -solve_triangular(L, A.T, lower=True).T
    length = np.linalg.norm(G, axis=1)
    some = length > _NONE
    if np.any(b[~some] < 0):  # what d does not change cannot be mended
        return None
    multipliers = np.zeros(b.size)
    G, h = G[some] / length[some, None], (-b[some] + G[some] @ shift) / length[some]
    far = h.max(initial=0.0)
    if far <= 0:
        return solve_triangular(L, -shift, lower=True, trans=1), multipliers
    E = np.vstack([G.T, h / far])
    target = np.zeros(c.size + 1)
    target[-1] = 1.0
    try:
        y, _ = nnls(E, target)
    except RuntimeError:  # it does not settle, which nearly parallel rows can cause
        return None
    rest = target - E @ y
    if min(rest @ rest, rest[-1]) < _FAR:  # which are the same but for rounding
        return None
    force = far * y / rest[-1]
    d = solve_triangular(L, G.T @ force - shift, lower=True, trans=1)
    if np.any(A @ d - b > 1e-8 * (1 + np.abs(b))):
        return None
    multipliers[some] = force / length[some]
    return d, multipliers

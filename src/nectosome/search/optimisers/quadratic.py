"""Small convex quadratic programs, as they arise in sequential quadratic programming."""

import daqp
import numpy as np
from jaxtyping import Float

_EXACT = 1e-12  # miss of a constraint, where solutions are of the order of 1
_NO_LIMIT = -1e30


def minimise_quadratic(
    B: Float[np.ndarray, "n n"],
    c: Float[np.ndarray, "n"],
    A: Float[np.ndarray, "k n"],
    b: Float[np.ndarray, "k"],
    length: float = 1.0,
) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "k"]] | None:
    r"""Minimise \( c^T d + d^T B d / 2 \) with \( A d \le b \), B positive definite.

    By the dual active-set solver DAQP (Arnstrom, Bemporad and Axehill 2022); `length` is the order of d. Returns d and
    the multipliers (>= 0) of the rows of A, or None where no d fits them.
    """
    size = float(np.abs(B).max())
    lower = np.full(b.size, _NO_LIMIT)
    d, _, flag, info = daqp.solve(
        B / size, c / (size * length), np.ascontiguousarray(A), b / length, lower, primal_tol=_EXACT
    )
    return (d * length, info["lam"] * (size * length)) if flag == 1 else None

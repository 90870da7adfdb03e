r"""Huber's loss: residuals beyond a bend count as their size and no more as their square: outliers weigh little.

$$ \rho(r) = r^2 \ \mathrm{for}\ |r| \le b, \quad b (2 |r| - b)\ \mathrm{beyond} $$

with residuals in standard errors (Huber 1964, Annals of Mathematical Statistics 35, 73).
"""

import numpy as np
from jaxtyping import Float

HUBER = 1.345  # standard errors; of normal noise 95 % of the information is kept
_NORMAL = 1.4826  # standard deviation of normal noise over its median magnitude


def loss_of(residuals: Float[np.ndarray, "r"], bend: float | None) -> float:
    """Sum of squares, or of Huber's loss with a bend."""
    size = np.abs(residuals)
    return float(np.sum(size**2 if bend is None else np.where(size <= bend, size**2, bend * (2 * size - bend))))


def robust_error(residuals: Float[np.ndarray, "r"]) -> float:
    """Standard error of residuals that are normal but for outliers; those that are NaN are left out."""
    return _NORMAL * float(np.nanmedian(np.abs(residuals)))


def robust_width(residuals: Float[np.ndarray, "r"], bend: float) -> float:
    r"""Standard errors of parameters over those of least squares with the standard error of a residual.

    The sandwich of Huber (1967) for residuals of one distribution, in standard errors: $\sqrt{E\,\psi^2}/E\,\psi'$,
    with the influence $\psi$, r between -b and b. NaN where none is within the bend.
    """
    within = np.abs(residuals) <= bend
    if not within.any():
        return float("nan")
    return float(np.sqrt(np.mean(np.clip(residuals, -bend, bend) ** 2)) / np.mean(within))

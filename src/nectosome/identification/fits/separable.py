"""Variable projection: fits of models that are linear in most of their parameters (Golub and Pereyra 1973)."""

from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.optimize import lsq_linear

from nectosome.units.ranges import Ranges

from .misfit import Misfit

_STEEPEST = 1e7  # condition number
_ON = 1e-9  # of the largest weight: as near to its bound is on it


class Separated(NamedTuple):
    """Parameters of a fit."""

    theta: Float[np.ndarray, "n"]
    weights: Float[np.ndarray, "k"]
    chi2: float


@dataclass(frozen=True)
class Separable:
    r"""A model $y = \Phi(\theta)\,w$ with weights of at least 0, and what it is to be fitted to.

    - basis: theta -> Phi [r, k], as the data; residuals are divided by `standard_error`.
    - jacobian: (theta, w) -> d(Phi w)/d theta [r, n].
    - data: y [r].
    """

    basis: Callable[[Float[np.ndarray, "n"]], Float[np.ndarray, "r k"]]
    jacobian: Callable[[Float[np.ndarray, "n"], Float[np.ndarray, "k"]], Float[np.ndarray, "r n"]]
    data: Float[np.ndarray, "r"]
    ranges: Ranges
    standard_error: float = 1.0

    def fit(self, theta: Float[np.ndarray, "n"], fixed: Collection[str] = ()) -> Separated:
        """Least squares from theta on, the weights being the best ones for each theta. A local minimum in theta.

        What is `fixed` of theta stays as it is.

        Where all weights are 0 at the start, their derivatives are 0 too; the first descent is then one
        with weights of either sign.
        """
        if not _Projection(self, np.asarray(theta, dtype=float)).weights.any():
            theta = self.projected(signed=True).fit(theta, fixed).theta
        found = self.projected().fit(theta, fixed)
        at = _Projection(self, found.theta)
        return Separated(found.theta, at.weights, found.chi2)

    def projected(self, signed: bool = False) -> Misfit:
        r"""Residuals $\Phi(\theta) w(\theta) - y$ as functions of theta alone; `signed` weights may be below 0.

        Their Jacobian is that of Kaufman (1975): $P\, (d\Phi/d\theta)\, w$, P projecting onto what the columns of the
        weights that are not on their bound leave. That is the whole gradient of the sum of squares.
        """
        latest: list[_Projection] = []

        def at(theta: Float[np.ndarray, "n"]) -> _Projection:
            if not (latest and np.array_equal(latest[0].theta, theta)):
                latest[:] = [_Projection(self, theta, signed)]
            return latest[0]

        def residuals(rows: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m r"]:
            return np.stack([at(row).residuals for row in rows])

        return Misfit(residuals, self.ranges, lambda theta: at(theta).jacobian)

    def whole(self, most: float) -> Misfit:
        """Residuals as functions of theta and all weights, `w1`, `w2`, ..., each from 0 to `most`."""
        n, k = len(self.ranges.names), self.basis(self.ranges.values(np.full(len(self.ranges.names), 0.5))).shape[1]
        low, high = (np.concatenate([x, np.full(k, w)]) for x, w in zip(self.ranges.bounds.T, (0.0, most), strict=True))
        names = (*self.ranges.names, *(f"w{i + 1}" for i in range(k)))
        log = [name for name, scaled in zip(self.ranges.names, self.ranges.log, strict=True) if scaled]

        def residuals(rows: Float[np.ndarray, "m n+k"]) -> Float[np.ndarray, "m r"]:
            return np.stack([self.basis(row[:n]) @ row[n:] - self.data for row in rows]) / self.standard_error

        def jacobian(row: Float[np.ndarray, "n+k"]) -> Float[np.ndarray, "r n+k"]:
            both = [self.jacobian(row[:n], row[n:]), self.basis(row[:n])]
            return np.concatenate(both, axis=1) / self.standard_error

        return Misfit(residuals, Ranges(names, low, high, log), jacobian)


class _Projection:
    """The best weights at theta, the residuals, and their Jacobian."""

    def __init__(self, of: Separable, theta: Float[np.ndarray, "n"], signed: bool = False):
        self.of, self.theta = of, theta
        basis = of.basis(theta)
        scale = np.linalg.norm(basis, axis=0)
        scale = np.where(scale > 0, scale, 1.0)
        columns, R = _orthonormal(basis / scale)
        least = -np.inf if signed else 0.0
        scaled = lsq_linear(R, columns.T @ of.data, (least, np.inf), method="bvls", tol=1e-14).x
        self.weights = scaled / scale
        free = np.abs(scaled) > _ON * np.abs(scaled).max(initial=0.0)
        self.span = columns if free.all() else _orthonormal(basis[:, free] / scale[free])[0]
        self.residuals = (basis @ self.weights - of.data) / of.standard_error

    @property
    def jacobian(self) -> Float[np.ndarray, "r n"]:
        """Kaufman's."""
        along = self.of.jacobian(self.theta, self.weights)
        return (along - self.span @ (self.span.T @ along)) / self.of.standard_error


def _orthonormal(x: Float[np.ndarray, "r k"]) -> tuple[Float[np.ndarray, "r k"], Float[np.ndarray, "k k"]]:
    """Q and R of x with many rows, by Cholesky's factors of products, twice: as exact as Householder's, and faster.

    That is so up to condition numbers of 1e7 (Yamamoto et al. 2015); beyond them it is Householder's.
    """
    Q, R = x, np.eye(x.shape[1])
    try:
        for _ in range(2):
            factor = np.linalg.cholesky(Q.T @ Q).T
            if np.linalg.cond(factor) > _STEEPEST:
                return np.linalg.qr(x)
            Q, R = Q @ np.linalg.inv(factor), factor @ R
    except np.linalg.LinAlgError:
        return np.linalg.qr(x)
    return Q, R

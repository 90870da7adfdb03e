"""Smooth functions known at a few points, with honest intervals between them: Gaussian processes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri
from scipy.stats import qmc

_DRAWS = 512  # of the hyperparameters, a power of 2
_LENGTH, _LENGTH_SPREAD = 2.0, 0.8  # median of a length in boxes, standard deviation of its logarithm
_SHARE, _SHARE_SPREAD = 0.25, 1.0  # the same of what varies, as a share of a term's size
_DOUBT_SPREAD = 1.5  # standard deviation of the logarithm of how far doubts are right
_WIDER, _LEAST = 1.5, 0.05  # variance of the second draws: times that of the first, and at least
_ROUNDING = 1e-6  # noise that is always there, of the size
_TINY = 1e-140  # instead of a size of 0; its square is a number too
_NO_SHARE = 1e-4  # of the largest: draws that count as nothing


class Surface(NamedTuple):
    """A function at some points, and how well it is known there."""

    mean: Float[np.ndarray, "n"]
    error: Float[np.ndarray, "n"]  # standard deviation of the function, without the noise of measuring it


class Term(NamedTuple):
    """A part s(x) (c + g(x)) of what is measured: a shape s that is given, times a smooth function that is not."""

    size: float  # of c, before anything is measured
    shape: Float[np.ndarray, "m"]  # s where it was measured
    shape_at: Float[np.ndarray, "n"]  # and where it is asked for


def gaussian_process(
    x: Float[np.ndarray, "m d"],
    y: Float[np.ndarray, "m"],
    noise: Float[np.ndarray, "m"],
    at: Float[np.ndarray, "n d"],
    terms: Sequence[Term] | None = None,
    doubt: Float[np.ndarray, "m"] | None = None,
) -> Surface:
    r"""What is measured as y at points x of the unit box with standard errors `noise`, at other points.

    $$ y = \sum_b s_b(x) (c_b + g_b(x)) + \epsilon $$

    with constants $c_b$, normal with the standard deviation $A_b$ that is a term's `size`, and functions $g_b$ of
    zero mean and covariance $a_b^2 k(r)$, $k = (1 + \sqrt5 r + \tfrac53 r^2) e^{-\sqrt5 r}$ (Matern 5/2),
    $r^2 = \sum_i (x_i - x'_i)^2/l_{bi}^2$. Without `terms` there is one, whose shape is 1. What is doubted has besides
    its noise an error of the size `doubt`, times a factor for all of them that is not known.

    Few points do not identify the sizes a, the lengths l and that factor: they are not fitted but averaged over, so
    that the error contains their uncertainty (Rasmussen and Williams 2006, ch. 5). Each of 512 draws is weighed by its
    likelihood. The first draws are from log-normal priors, a quarter of A by a factor of e, 2 boxes by one of 2.2, and
    1 by one of 4.5; they set where the second ones are taken (Cappe et al. 2004). Raises ValueError without points,
    and for what is no finite number.
    """
    if not len(x):
        raise ValueError("gaussian_process: no points; at least one is needed.")
    if terms is None:
        size = max(float(np.sqrt(np.mean(y**2))), float(noise.mean()), _TINY)
        terms = [Term(size, np.ones(len(x)), np.ones(len(at)))]
    if not all(np.isfinite(v).all() for v in (x, y, noise, at, *(v for term in terms for v in term))):
        raise ValueError("gaussian_process: points, values, errors and shapes must be finite numbers.")
    known = _Known(x, y, noise, np.zeros(len(x)) if doubt is None else doubt)
    sobol = ndtri(qmc.Sobol(1 + len(terms) * (1 + x.shape[1]), rng=np.random.default_rng(0)).random(_DRAWS))
    first = _Draws(known, terms, sobol)
    share = first.shares(np.zeros(_DRAWS))
    centre = share @ sobol
    spread = (share[:, None] * (sobol - centre)).T @ (sobol - centre)
    root = np.linalg.cholesky(_WIDER * (spread + _LEAST * np.eye(len(spread))))
    second = centre + sobol @ root.T
    # by how much likelier a draw is under the priors than where it was drawn
    prior = 0.5 * np.sum(sobol**2, axis=1) - 0.5 * np.sum(second**2, axis=1)
    found = _Draws(known, terms, second)
    return found.surface(found.shares(prior), at)


class _Known(NamedTuple):
    """What was measured."""

    x: Float[np.ndarray, "m d"]
    y: Float[np.ndarray, "m"]
    noise: Float[np.ndarray, "m"]
    doubt: Float[np.ndarray, "m"]


class _Draws:
    """Covariances of measured values for many draws of the hyperparameters, and how likely the values are."""

    def __init__(self, known: _Known, terms: Sequence[Term], draws: Float[np.ndarray, "r k"]):
        self.x, self.terms, b, m = known.x, terms, len(terms), len(known.x)
        sizes = np.array([term.size for term in terms])
        self.a = _SHARE * sizes * np.exp(_SHARE_SPREAD * draws[:, :b])
        self.lengths = _LENGTH * np.exp(_LENGTH_SPREAD * draws[:, b:-1]).reshape(len(draws), b, -1)
        own = self._covariance(self.x, [term.shape for term in terms], slice(None))
        noise = np.hypot(known.noise, known.doubt * np.exp(_DOUBT_SPREAD * draws[:, -1:]))
        diagonal = noise**2 + _ROUNDING**2 * np.maximum(np.einsum("rii->ri", own), _TINY)
        self.L = np.linalg.cholesky(own + diagonal[:, :, None] * np.eye(m))
        self.values = np.linalg.solve(self.L, np.broadcast_to(known.y[:, None], (len(draws), m, 1)))[:, :, 0]

    def _covariance(
        self, at: Float[np.ndarray, "n d"], shapes: Sequence[Float[np.ndarray, "n"]], of: slice | np.ndarray
    ) -> Float[np.ndarray, "r m n"]:
        """Of the measured values with those at some points, without noise."""
        apart = (self.x[:, None] - at) ** 2
        out = np.zeros((len(self.a[of]), len(self.x), len(at)))
        for i, (term, there) in enumerate(zip(self.terms, shapes, strict=True)):
            r = np.sqrt(5 * np.einsum("mnd,rd->rmn", apart, self.lengths[of, i] ** -2.0))
            g = self.a[of, i, None, None] ** 2 * (1 + r + r**2 / 3) * np.exp(-r)
            out += np.outer(term.shape, there) * (term.size**2 + g)
        return out

    def shares(self, prior: Float[np.ndarray, "r"]) -> Float[np.ndarray, "r"]:
        """Weight of each draw, given the logarithm of what it weighs before anything is measured."""
        halves = np.sum(np.log(np.diagonal(self.L, axis1=1, axis2=2)), axis=1)
        logs = prior - 0.5 * np.sum(self.values**2, axis=1) - halves
        share = np.exp(logs - logs.max())
        return share / share.sum()

    def surface(self, share: Float[np.ndarray, "r"], at: Float[np.ndarray, "n d"]) -> Surface:
        """Mean and error over the draws."""
        of = np.flatnonzero(share > _NO_SHARE * share.max())
        share = share[of] / share[of].sum()
        across = np.linalg.solve(self.L[of], self._covariance(at, [term.shape_at for term in self.terms], of))
        means = np.einsum("rmn,rm->rn", across, self.values[of])
        alone = sum(term.shape_at**2 * (term.size**2 + self.a[of, i, None] ** 2) for i, term in enumerate(self.terms))
        variances = np.maximum(alone - np.sum(across**2, axis=1), 0.0)
        mean = share @ means
        return Surface(mean, np.sqrt(share @ (variances + (means - mean) ** 2)))

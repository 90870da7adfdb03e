"""A smooth function known at a few points, with honest intervals between them: a Gaussian process."""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import norm, qmc

_DRAWS = 512  # of the hyperparameters, a power of 2
_LENGTH, _LENGTH_SPREAD = 0.8, 0.8  # median of a length in boxes, standard deviation of its logarithm
_SIZE_SPREAD = 1.0  # standard deviation of the logarithm of the size about that of the values
_ROUNDING = 1e-6  # noise that is always there, of the size


class Surface(NamedTuple):
    """What a Gaussian process says at some points."""

    mean: Float[np.ndarray, "n"]
    error: Float[np.ndarray, "n"]  # standard deviation of the function, without the noise of measuring it


def gaussian_process(
    x: Float[np.ndarray, "m d"], y: Float[np.ndarray, "m"], noise: Float[np.ndarray, "m"], at: Float[np.ndarray, "n d"]
) -> Surface:
    r"""A function y known at points x of the unit box with standard errors `noise`, at other points.

    $y = f(x) + \epsilon$, f of zero mean and covariance $a^2 k(r)$, $k = (1 + \sqrt5 r + \tfrac53 r^2) e^{-\sqrt5 r}$
    (Matern 5/2), $r^2 = \sum_i (x_i - x'_i)^2/l_i^2$. Few points do not tell the size a and the lengths l: they are not
    fitted but averaged over, each of 512 draws from log-normal priors weighed by its likelihood (Rasmussen and
    Williams 2006, ch. 5), so that the error holds what is not known of them. Priors: a about the root mean square of y,
    by a factor of e; l about 0.8 of the box, by a factor of 2.2. Raises ValueError for numbers that are not finite.
    """
    if not (np.isfinite(x).all() and np.isfinite(y).all() and np.isfinite(noise).all() and np.isfinite(at).all()):
        raise ValueError("gaussian_process: points, values and errors must be finite numbers.")
    m, d = x.shape
    size = max(float(np.sqrt(np.mean(y**2))), float(noise.mean()), 1e-300) if m else 1.0
    draws = norm.ppf(qmc.Sobol(d + 1, rng=np.random.default_rng(0)).random(_DRAWS))
    a = size * np.exp(_SIZE_SPREAD * draws[:, 0])
    lengths = _LENGTH * np.exp(_LENGTH_SPREAD * draws[:, 1:])
    if not m:
        return Surface(np.zeros(len(at)), np.full(len(at), np.inf))
    diagonal = (noise**2 + (_ROUNDING * a[:, None]) ** 2)[:, :, None] * np.eye(m)
    L = np.linalg.cholesky(a[:, None, None] ** 2 * _matern(x, x, lengths) + diagonal)
    across = np.linalg.solve(L, a[:, None, None] ** 2 * _matern(x, at, lengths))
    values = np.linalg.solve(L, np.broadcast_to(y[:, None], (_DRAWS, m, 1)))[:, :, 0]
    means = np.einsum("kmn,km->kn", across, values)
    variances = np.maximum(a[:, None] ** 2 - np.sum(across**2, axis=1), 0.0)
    logs = -0.5 * np.sum(values**2, axis=1) - np.sum(np.log(np.diagonal(L, axis1=1, axis2=2)), axis=1)
    share = np.exp(logs - logs.max())
    share /= share.sum()
    mean = share @ means
    return Surface(mean, np.sqrt(share @ (variances + (means - mean) ** 2)))


def _matern(
    x: Float[np.ndarray, "m d"], z: Float[np.ndarray, "n d"], lengths: Float[np.ndarray, "k d"]
) -> Float[np.ndarray, "k m n"]:
    r = np.sqrt(5 * np.einsum("mnd,kd->kmn", (x[:, None] - z) ** 2, lengths**-2.0))
    return (1 + r + r**2 / 3) * np.exp(-r)

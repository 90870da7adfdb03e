"""Errors of samples: correlation time, propagation through a filter, readings in steps."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float
from scipy.fft import next_fast_len
from scipy.signal import oaconvolve

_ORDERS = 12  # the highest of an autoregressive process
ROUNDED = 12**-0.5  # root mean square of errors that are even within a step, in steps
_GRID = 0.1  # of a step: how far readings are from its multiples at most, as they are written with few digits
FELT = 0.05  # share of second differences that noise makes, from which on it matters
_LEVELS = 20  # of a range, at least: fewer are a command's, such as of a valve


@dataclass(frozen=True)
class Weights:
    """A linear filter of even samples, as the weights of an output's inputs.

    - kernel: of the samples n - m to n + m, for an output n away from the ends.
    - first(i): of the samples 0, 1, ..., for the output i < m; the other end is the mirror image.
    """

    kernel: Float[np.ndarray, "w"]  # w = 2 m + 1
    first: Callable[[int], Float[np.ndarray, "k"]]

    @property
    def gain(self) -> float:
        """Standard deviation of filtered white noise over that of the noise itself: sqrt(sum h^2)."""
        return float(np.sqrt(np.sum(self.kernel**2)))


def filtered_se(
    se: Float[np.ndarray, "*batch n"], weights: Weights, independent: bool
) -> Float[np.ndarray, "*batch n"]:
    """Standard error after a filter, with the filter's own weights near the ends.

    sqrt(sum_k w_nk^2 se_k^2) for `independent` errors of samples; else sum_k |w_nk| se_k, the bound for any
    correlation.
    """
    power = 2 if independent else 1
    n, m = se.shape[-1], len(weights.kernel) // 2
    before = se**power
    after = np.empty_like(before)
    kernel = np.abs(weights.kernel) ** power
    if n > 2 * m:
        row = kernel.reshape(*[1] * (se.ndim - 1), -1)
        after[..., m : n - m] = oaconvolve(before, row, mode="valid", axes=-1)
    for i in range(min(m, (n + 1) // 2)):  # each output has its own weights
        row = np.abs(weights.first(i)[:n]) ** power
        after[..., i] = before[..., : len(row)] @ row
        after[..., n - 1 - i] = before[..., ::-1][..., : len(row)] @ row
    return np.maximum(after, 0.0) ** (1 / power)


def correlation_time(residuals: Float[np.ndarray, "n"], parameters: float | None = None) -> float:
    """Integrated autocorrelation time: samples per independent sample, at least 1.

    $$ \\tau = 1 + 2 \\sum_k \\rho_k $$

    over the lags up to the first pair of autocorrelations with a sum that is not positive (Geyer 1992, Practical Markov
    chain Monte Carlo, sec. 3.3: initial positive sequence). Too large for oscillating residuals.

    Of residuals of a fit of so many `parameters` these autocorrelations are too low. There it is that of an
    autoregressive process, without its bias, where that is larger, by up to a factor of 2.
    """
    n = len(residuals)
    x = residuals - residuals.mean()
    length = next_fast_len(2 * n, real=True)
    rho = np.fft.irfft(np.abs(np.fft.rfft(x, length)) ** 2, length)[:n]
    if n < 4 or not rho[0] > 0:
        return 1.0
    rho = rho / rho[0]
    pairs = rho[: n // 2 * 2].reshape(-1, 2).sum(axis=1)
    ends = np.flatnonzero(pairs <= 0)
    summed = max(1.0, float(2 * pairs[: ends[0] if len(ends) else len(pairs)].sum() - 1))
    if parameters is None:
        return summed
    return float(np.clip(_autoregressive_time(rho, n, parameters), summed, 2 * summed))


def _autoregressive_time(rho: Float[np.ndarray, "n"], n: int, parameters: float) -> float:
    r"""Correlation time of the autoregressive process of n samples with these autocorrelations.

    Its spectrum at frequency 0 over its variance, $\tau = \sigma^2/(1 - s)^2$, with the sum s of the coefficients
    (Levinson and Durbin), their number by Bayes' criterion, and the share $\sigma^2$ of the variance that they do not
    predict. In the mean s is too low by about $(1 + 3 s + p (1 + s))/n$ with p parameters (Marriott and Pope 1954, for
    order 1).
    """
    a, error, best = np.zeros(0), 1.0, 0.0
    time = 1.0
    for k in range(1, min(n // 4, _ORDERS) + 1):
        reflected = (rho[k] - a @ rho[k - 1 : 0 : -1]) / error
        a = np.append(a - reflected * a[::-1], reflected)
        error *= 1 - reflected**2
        if not error > 0:
            break
        criterion = n * np.log(error) + k * np.log(n)
        if criterion < best:
            best, s = criterion, float(a.sum())
            s = min(s + (1 + 3 * s + parameters * (1 + s)) / n, 1 - 1 / n)
            time = (1 + s) / (1 - s) if k == 1 else error / (1 - s) ** 2
    return time


def resolution(values: Float[np.ndarray, "n"]) -> float:
    """Step whose multiples, from the least one, all values are; 0 where there is none, or it is too fine to matter.

    An error that is even within a step q makes second differences of $q / \\sqrt{2}$.
    """
    known = np.unique(values)
    gaps = np.diff(known)
    if gaps.size == 0 or gaps.min() == 0:
        return 0.0
    single = np.mean(gaps[gaps < 1.5 * gaps.min()])
    multiples = np.concatenate([[0.0], np.cumsum(np.round(gaps / single))])  # errors of digits do not add up over gaps
    step = float((known[-1] - known[0]) / multiples[-1])
    felt = roughness(values, ROUNDED * step) > FELT and multiples[-1] >= _LEVELS
    return step if felt and np.abs(known - known[0] - step * multiples).max() < _GRID * step else 0.0


def roughness(values: Float[np.ndarray, "n"], noise: float) -> float:
    """Share of second differences that white noise of this standard deviation makes (root mean squares)."""
    size = float(np.sqrt(np.mean(np.diff(values, 2) ** 2))) if values.size > 2 else 0.0
    return min(np.sqrt(6) * noise / size, 1.0) if size > 0 else 1.0

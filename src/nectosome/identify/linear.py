r"""Models whose rate is linear in what is not known, $\dot x = H(t, x) \theta$, from recordings of x, in four ways.

`increments` is least squares on differences of neighbouring samples, as many papers do it: noise makes it biased, and
its errors wrong. `windows` takes differences over longer times and the noise as it is; `instruments` takes regressors
from the model instead of from noisy samples; `output_error` fits the motion itself, and is the one to take.
"""

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares
from scipy.stats import norm

from nectosome.measure.signals.noise import correlation_time

Regressors = Callable[[Array, Array], Array]  # (time, state) -> [k], for JAX
_ROUNDS = 20  # of instruments
_CLOSE = 1e-10  # relative, of parameters from round to round
_SETTLED = 0.1  # of the state's root mean square: means of the two halves may differ by as much
_NOISY = 0.1  # of what is left of increments: a share of noise that biases
_TOGETHER = 5.0  # samples that residuals hang together for: more than noise does by chance
_QUARTERS = 4  # steps from sample to sample


class Trial(NamedTuple):
    """One recording: evenly spread times [s], the state, and H with the inputs of this recording."""

    time: Float[np.ndarray, "n"]
    state: Float[np.ndarray, "n"]
    regressors: Regressors


class Estimate(NamedTuple):
    """Parameters with their covariance; what is left of each equation or sample; and what to beware of."""

    values: Float[np.ndarray, "k"]
    covariance: Float[np.ndarray, "k k"]
    residuals: Float[np.ndarray, "r"]
    warnings: tuple[str, ...] = ()

    @property
    def errors(self) -> Float[np.ndarray, "k"]:
        """Standard errors."""
        return np.sqrt(np.diagonal(self.covariance))

    @property
    def percent(self) -> Float[np.ndarray, "k"]:
        """Standard errors, in percent of the values."""
        return 100 * self.errors / np.abs(self.values)

    def interval(self, coverage: float = 0.95) -> Float[np.ndarray, "k 2"]:
        """Normal interval of each parameter that holds the true one with this probability."""
        half = norm.ppf(0.5 + coverage / 2) * self.errors
        return np.stack([self.values - half, self.values + half], axis=1)

    def of(self, f: Callable[[Array], Array]) -> Self:
        """Estimate of a function of the parameters: first order, $J \\Sigma J^T$ (the delta method)."""
        at = jnp.asarray(self.values)
        J = np.atleast_2d(jax.jacfwd(f)(at))
        return self._replace(values=np.atleast_1d(f(at)), covariance=J @ self.covariance @ J.T)


def increments(trials: Sequence[Trial]) -> Estimate:
    r"""Least squares on $x_{k+1} - x_k = h H(t_k, x_k) \theta$ (Giorgio-Serchi et al. 2017, eqs. 4 to 9).

    As it is printed: rectangles, and errors as if those of neighbouring increments had nothing to do with each other.
    The noise of a sample is in two of them, with opposite signs.
    """
    y = np.concatenate([np.diff(trial.state) for trial in trials])
    X = np.concatenate([np.diff(trial.time)[:, None] * _rows(trial)[:-1] for trial in trials])
    inverse = np.linalg.inv(X.T @ X)
    values = inverse @ X.T @ y
    left = y - X @ values
    told = [*_unsettled(trials)]
    # neighbouring increments of a smooth motion hang together, those of noise go against each other
    against = -sum(float(a[1:] @ a[:-1]) for a in np.split(left, np.cumsum([len(t.time) - 1 for t in trials])[:-1]))
    if against > _NOISY * (left @ left):
        told.append("biased: what is left of neighbouring increments has opposite signs, as noise of samples has")
    return Estimate(values, left @ left / (len(y) - len(values)) * inverse, left, tuple(told))


def windows(trials: Sequence[Trial], lengths: Sequence[float]) -> Estimate:
    r"""Least squares on $x(t + T) - x(t) = \int_t^{t + T} H \theta$ for all t and some lengths T [s]: trapezoids.

    Half and whole periods are good lengths: one tells what changes within a period, the other what lasts. Errors are
    those of samples with independent noise of one size, $\Sigma = \sigma^2 P D D^T P^T$ with the differences D and
    $P = (X^T X)^{-1} X^T$. Raises ValueError for a length that a recording has not.
    """
    return _solved(trials, lengths, None)


def instruments(trials: Sequence[Trial], lengths: Sequence[float]) -> Estimate:
    """As `windows`, with regressors of the model's own motion as instruments, which hold the first sample's noise only.

    From round to round the motion is that of the parameters found before (Young 2011, ch. 8).
    """
    found = windows(trials, lengths)
    for _ in range(_ROUNDS):
        motions = [np.asarray(_motion(t.regressors, t.time, found.values, t.state[0])) for t in trials]
        before, found = found, _solved(trials, lengths, motions)
        if np.all(np.abs(found.values - before.values) <= _CLOSE * np.abs(found.values)):
            return found
    return found._replace(warnings=(*found.warnings, f"not settled after {_ROUNDS} rounds of instruments"))


def output_error(trials: Sequence[Trial], start: Float[np.ndarray, "k"]) -> Estimate:
    r"""Least squares of the samples against the motion itself, from parameters `start` on; first states are fitted too.

    $$ \min \sum_k (x_k - x(t_k; \theta, x_0))^2, \quad \Sigma = \tau s^2 (J^T J)^{-1} $$

    Unbiased for noise of samples, however large. With residuals that hang together for $\tau$ samples the model is not
    all there is; they count as fewer.
    """
    k, m = len(start), len(trials)
    begin = np.concatenate([start, [trial.state[0] for trial in trials]])
    size = np.abs(np.concatenate([start, [np.ptp(trial.state) for trial in trials]]))
    size[size == 0] = 1.0

    def split(p: Float[np.ndarray, "q"]) -> list[tuple[Trial, np.ndarray, float]]:
        return [(trial, p[:k] * size[:k], p[k + i] * size[k + i]) for i, trial in enumerate(trials)]

    def residuals(p: Float[np.ndarray, "q"]) -> Float[np.ndarray, "r"]:
        return np.concatenate([t.state - np.asarray(_motion(t.regressors, t.time, *at)) for t, *at in split(p)])

    def slopes(p: Float[np.ndarray, "q"]) -> Float[np.ndarray, "r q"]:
        rows = []
        for i, (t, *at) in enumerate(split(p)):
            by_theta, by_x0 = _slopes(t.regressors, t.time, *at)
            own = np.zeros((len(t.time), k + m))
            own[:, :k], own[:, k + i] = by_theta, by_x0
            rows.append(-own * size)
        return np.concatenate(rows)

    closely: Any = {"jac": slopes, "method": "lm", "xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12}
    found = least_squares(residuals, begin / size, **closely)
    J, left = found.jac, found.fun
    together = max(correlation_time(left), 1.0)
    covariance = together * left @ left / (len(left) - k - m) * np.linalg.inv(J.T @ J)
    told = [*_unsettled(trials)]
    if together > _TOGETHER:
        told.append(f"residuals hang together for {together:.0f} samples: the model does not hold all that is there")
    if not found.success:
        told.append(f"not solved: {found.message}")
    return Estimate(found.x[:k] * size[:k], (covariance * np.outer(size, size))[:k, :k], left, tuple(told))


def _solved(
    trials: Sequence[Trial], lengths: Sequence[float], motions: Sequence[Float[np.ndarray, "n"]] | None
) -> Estimate:
    """`windows`, with instruments from motions if there are any."""
    parts = [_windowed(trial, lengths, None if motions is None else motions[i]) for i, trial in enumerate(trials)]
    y, X, Z = (np.concatenate([part[i] for part in parts]) for i in range(3))
    inverse = np.linalg.inv(Z.T @ X)
    values = inverse @ Z.T @ y
    left = y - X @ values
    spread = sum(part[3].T @ part[3] for part in parts)  # Z^T D D^T Z
    # of D e the residuals keep all but what the parameters take
    kept = 2 * len(y) - np.trace(inverse @ sum(part[3].T @ part[4] for part in parts))
    covariance = left @ left / kept * inverse @ spread @ inverse.T
    return Estimate(values, covariance, left, _unsettled(trials))


def _windowed(trial: Trial, lengths: Sequence[float], motion: Float[np.ndarray, "n"] | None) -> tuple[np.ndarray, ...]:
    """Differences, regressors and instruments of all windows of a trial; D^T of instruments and of regressors."""
    step = float(np.mean(np.diff(trial.time)))
    n = len(trial.time)
    X = _integral(trial.time, _rows(trial))
    Z = X if motion is None else _integral(trial.time, _rows(trial._replace(state=motion)))
    first, last = [], []
    for length in lengths:
        w = round(length / step)
        if not 0 < w < n:
            raise ValueError(f"windows: {length:g} s does not fit into a recording of {n} samples, {step:g} s apart.")
        first.append(np.arange(n - w))
        last.append(np.arange(w, n))
    i, j = np.concatenate(first), np.concatenate(last)
    regressors, instruments_ = X[j] - X[i], Z[j] - Z[i]
    back = [np.zeros_like(X), np.zeros_like(X)]
    for part, rows in zip(back, (instruments_, regressors), strict=True):
        np.add.at(part, j, rows)
        np.subtract.at(part, i, rows)
    return trial.state[j] - trial.state[i], regressors, instruments_, *back


def _rows(trial: Trial) -> Float[np.ndarray, "n k"]:
    """H at the samples."""
    return np.asarray(_at_samples(trial.regressors, trial.time, trial.state))


def _integral(time: Float[np.ndarray, "n"], H: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
    """From the first sample to each: trapezoids."""
    parts = 0.5 * np.diff(time)[:, None] * (H[1:] + H[:-1])
    return np.concatenate([np.zeros((1, H.shape[1])), np.cumsum(parts, axis=0)])


def _unsettled(trials: Sequence[Trial]) -> tuple[str, ...]:
    """What is told of trials whose halves have other means."""
    halves = [[float(np.mean(part)) for part in np.array_split(trial.state, 2)] for trial in trials]
    far = [abs(a - b) > _SETTLED * np.sqrt(np.mean(t.state**2)) for (a, b), t in zip(halves, trials, strict=True)]
    return (f"not settled: {sum(far)} of {len(trials)} recordings change from half to half",) if any(far) else ()


@partial(jax.jit, static_argnums=0)
def _at_samples(regressors: Regressors, time: Array, state: Array) -> Array:
    return jax.vmap(regressors)(time, state)


@partial(jax.jit, static_argnums=0)
def _motion(regressors: Regressors, time: Array, theta: Array, x0: Array) -> Array:
    """States at the times: the classical Runge-Kutta method in quarters of a sample."""

    def rate(t: Array, x: Array) -> Array:
        return regressors(t, x) @ theta

    def step(x: Array, ends: tuple[Array, Array]) -> tuple[Array, Array]:
        t, h = ends[0], (ends[1] - ends[0]) / _QUARTERS
        for q in range(_QUARTERS):
            s = t + q * h
            a = rate(s, x)
            b = rate(s + h / 2, x + h / 2 * a)
            c = rate(s + h / 2, x + h / 2 * b)
            x = x + h / 6 * (a + 2 * b + 2 * c + rate(s + h, x + h * c))
        return x, x

    _, states = jax.lax.scan(step, x0, (time[:-1], time[1:]))
    return jnp.concatenate([x0[None], states])


_slopes = partial(jax.jit, static_argnums=0)(jax.jacfwd(_motion, argnums=(2, 3)))

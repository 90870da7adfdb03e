r"""Models whose rate is linear in unknown parameters, $\dot x = H(t, x, u) \theta$, fitted to recordings of x.

Four estimators: `finite_differences` is least squares on differences of neighbouring samples, as often published: noise
biases it and its standard errors. `integral_windows` integrates over longer times and accounts for the noise;
`instrumental_variables` takes regressors from the model instead of from noisy samples; `output_error` fits the motion
itself, and is recommended.
"""

from collections.abc import Callable, Sequence
from functools import lru_cache, partial
from typing import Any, NamedTuple, Self

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.ndimage import convolve1d
from scipy.optimize import least_squares
from scipy.special import ndtri

from nectosome.core import runtime as runtime  # float64
from nectosome.measure.signals.noise import correlation_time

from .errors import CORRELATED

Regressors = Callable[..., Array]  # (time, state, *inputs) -> [k], for JAX
Input = Callable[[np.ndarray], np.ndarray]  # of times [s], such as a spline through a recording
_STEPS = 4  # from sample to sample
_PLACES = np.linspace(0.0, 1.0, 2 * _STEPS + 1)  # between two samples, at which inputs are evaluated
_ROUNDS = 20  # of instrumental variables
_CLOSE = 1e-10  # relative, of parameters from round to round
_SETTLED = 0.1  # of the state's root mean square: means of the two halves may differ by as much
_NOISY = 0.1  # of the residuals of differences: a share of noise that biases
_RAW = np.ones(1)  # kernel of no filter


class Trial(NamedTuple):
    """One recording: evenly spread times [s], the state, H, and the inputs of this recording that H takes after it."""

    time: Float[np.ndarray, "n"]
    state: Float[np.ndarray, "n"]
    regressors: Regressors
    inputs: tuple[Input, ...] = ()


class Estimate(NamedTuple):
    """Parameters with their covariance, the residual of each equation or sample, and warnings."""

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
        half = ndtri(0.5 + coverage / 2) * self.errors
        return np.stack([self.values - half, self.values + half], axis=1)

    def of(self, f: Callable[[Array], Array]) -> Self:
        """Estimate of a function of the parameters: first order, $J \\Sigma J^T$ (the delta method)."""
        at = jnp.asarray(self.values)
        J = np.atleast_2d(jax.jacfwd(f)(at))
        return self._replace(values=np.atleast_1d(f(at)), covariance=J @ self.covariance @ J.T)


def finite_differences(trials: Sequence[Trial]) -> Estimate:
    r"""Least squares on $x_{k+1} - x_k = h H(t_k, x_k) \theta$ (Giorgio-Serchi et al. 2017, eqs. 4 to 9).

    As published: rectangles, and standard errors as if neighbouring differences were independent. The noise of a
    sample is in two of them, with opposite signs.
    """
    y = np.concatenate([np.diff(trial.state) for trial in trials])
    X = np.concatenate([np.diff(trial.time)[:, None] * _rows(trial)[:-1] for trial in trials])
    inverse = np.linalg.inv(X.T @ X)
    values = inverse @ X.T @ y
    left = y - X @ values
    warnings = [*_unsettled(trials)]
    # neighbouring differences of a smooth motion are correlated, those of noise have opposite signs
    against = -sum(float(a[1:] @ a[:-1]) for a in np.split(left, np.cumsum([len(t.time) - 1 for t in trials])[:-1]))
    if against > _NOISY * (left @ left):
        warnings.append("biased: residuals of neighbouring differences have opposite signs, as noise of samples has")
    return Estimate(values, left @ left / (len(y) - len(values)) * inverse, left, tuple(warnings))


def integral_windows(
    trials: Sequence[Trial],
    lengths: Sequence[float],
    kernel: Float[np.ndarray, "w"] = _RAW,
    motions: Sequence[Float[np.ndarray, "n"]] | None = None,
) -> Estimate:
    r"""Least squares on $x(t + T) - x(t) = \int_t^{t + T} H \theta$ for all t and some lengths T [s]: trapezoids.

    Half and whole periods are good lengths: one shows changes within a period, the other the trend. Errors are
    those of samples with independent noise of one size, $\Sigma = \sigma^2 P D F F^T D^T P^T$ with the differences D,
    the symmetric filter F that state and inputs have gone through alike (its `kernel`), and $P = (X^T X)^{-1} X^T$.
    Regressors along `motions` are instruments, if there are any. Raises ValueError for a length that a recording has
    not.
    """
    own = [None] * len(trials) if motions is None else motions
    parts = [_windowed(trial, lengths, kernel, motion) for trial, motion in zip(trials, own, strict=True)]
    y, X, Z = (np.concatenate([part[i] for part in parts]) for i in range(3))
    inverse = np.linalg.inv(Z.T @ X)
    values = inverse @ Z.T @ y
    left = y - X @ values
    spread = sum(part[3].T @ part[3] for part in parts)  # Z^T D F F^T D^T Z
    # of D F e the residuals keep all but what the parameters take
    kept = sum(part[5] for part in parts) - np.trace(inverse @ sum(part[3].T @ part[4] for part in parts))
    covariance = left @ left / kept * inverse @ spread @ inverse.T
    return Estimate(values, covariance, left, _unsettled(trials))


def instrumental_variables(trials: Sequence[Trial], lengths: Sequence[float]) -> Estimate:
    """As `integral_windows`, with regressors of the model's own motion as instruments: free of noise but the first.

    From round to round the motion is that of the parameters found before (Young 2011, ch. 8).
    """
    found = integral_windows(trials, lengths)
    for _ in range(_ROUNDS):
        motions = [np.asarray(_motion(*_arguments(t), np.append(found.values, t.state[0]))) for t in trials]
        before, found = found, integral_windows(trials, lengths, motions=motions)
        if np.all(np.abs(found.values - before.values) <= _CLOSE * np.abs(found.values)):
            return found
    return found._replace(warnings=(*found.warnings, f"not converged after {_ROUNDS} rounds of instrumental variables"))


def output_error(trials: Sequence[Trial], start: Float[np.ndarray, "k"]) -> Estimate:
    r"""Least squares of the samples against the motion itself, from parameters `start` on; first states are fitted too.

    $$ \min \sum_k (x_k - x(t_k; \theta, x_0))^2, \quad \Sigma = \tau s^2 (J^T J)^{-1} $$

    Unbiased for noise of samples, however large. Residuals that are correlated over $\tau$ samples count as so many
    fewer: the model lacks something.
    """
    k, m = len(start), len(trials)
    begin = np.concatenate([start, [trial.state[0] for trial in trials]])
    size = np.abs(np.concatenate([start, [np.ptp(trial.state) for trial in trials]]))
    size[size == 0] = 1.0
    longest = max(len(trial.time) for trial in trials)  # of one length all are one program
    programs = [_arguments(trial, longest) for trial in trials]
    state = np.concatenate([trial.state for trial in trials])

    @lru_cache(maxsize=1)  # the solver calls for residuals and Jacobian at one place after the other
    def at(place: bytes) -> tuple[Float[np.ndarray, "r"], Float[np.ndarray, "r q"]]:
        p = np.frombuffer(place) * size
        states, derivatives = [], []
        for i, (trial, what) in enumerate(zip(trials, programs, strict=True)):
            x, by = (np.asarray(y)[: len(trial.time)] for y in _with_derivatives(*what, p[[*range(k), k + i]]))
            own = np.zeros((len(x), k + m))
            own[:, :k], own[:, k + i] = by[:, :k], by[:, k]
            states.append(x)
            derivatives.append(-own * size)
        return state - np.concatenate(states), np.concatenate(derivatives)

    closely: Any = {"method": "lm", "xtol": 1e-12, "ftol": 1e-12, "gtol": 1e-12, "jac": lambda p: at(p.tobytes())[1]}
    found = least_squares(lambda p: at(p.tobytes())[0], begin / size, **closely)
    J, left = found.jac, found.fun
    tau = correlation_time(left, k + m)
    covariance = tau * left @ left / (len(left) - k - m) * np.linalg.inv(J.T @ J)
    warnings = [*_unsettled(trials)]
    if tau > CORRELATED:
        warnings.append(f"residuals are correlated over {tau:.0f} samples: the model lacks something")
    if not found.success:
        warnings.append(f"not solved: {found.message}")
    return Estimate(found.x[:k] * size[:k], (covariance * np.outer(size, size))[:k, :k], left, tuple(warnings))


def _windowed(
    trial: Trial,
    lengths: Sequence[float],
    kernel: Float[np.ndarray, "w"],
    motion: Float[np.ndarray, "n"] | None,
) -> tuple[Any, ...]:
    """Differences, regressors and instruments of all windows of a trial; F^T D^T of both; the trace of D F F^T D^T."""
    step = float(np.mean(np.diff(trial.time)))
    n = len(trial.time)
    X = _integral(trial.time, _rows(trial))
    Z = X if motion is None else _integral(trial.time, _rows(trial._replace(state=motion)))
    first = list[np.ndarray]()
    for length in lengths:
        w = round(length / step)
        if not 0 < w < n:
            apart = f"a recording of {n} samples, {step:g} s apart"
            raise ValueError(f"integral_windows: {length:g} s does not fit into {apart}.")
        first.append(np.arange(n - w))
    i, j = np.concatenate(first), np.concatenate([k + n - len(k) for k in first])
    regressors, instruments = X[j] - X[i], Z[j] - Z[i]
    back = [np.zeros_like(X), np.zeros_like(X)]
    for part, rows in zip(back, (instruments, regressors), strict=True):
        np.add.at(part, j, rows)
        np.subtract.at(part, i, rows)
    back = [convolve1d(part, kernel, axis=0, mode="nearest") for part in back]
    alike = np.correlate(kernel, kernel, "full")[len(kernel) - 1 :]  # F F^T by lag
    trace = sum(2 * len(a) * (alike[0] - (alike[n - len(a)] if n - len(a) < len(alike) else 0.0)) for a in first)
    return trial.state[j] - trial.state[i], regressors, instruments, *back, trace


def _rows(trial: Trial) -> Float[np.ndarray, "n k"]:
    """H at the samples."""
    inputs = tuple(np.asarray(u(trial.time), float) for u in trial.inputs)
    return np.asarray(_at_samples(trial.regressors, trial.time, trial.state, inputs))


def _arguments(trial: Trial, samples: int | None = None) -> tuple[Regressors, np.ndarray, tuple[np.ndarray, ...]]:
    """Arguments of `_motion`, with inputs at all times that it needs; samples beyond the last one repeat it."""
    more = 0 if samples is None else samples - len(trial.time)
    times = trial.time[:-1, None] + np.diff(trial.time)[:, None] * _PLACES
    inputs = (np.asarray(u(times), float) for u in trial.inputs)
    time = np.pad(trial.time, (0, more), mode="edge")
    return trial.regressors, time, tuple(np.pad(u, ((0, more), (0, 0)), mode="edge") for u in inputs)


def _integral(time: Float[np.ndarray, "n"], H: Float[np.ndarray, "n k"]) -> Float[np.ndarray, "n k"]:
    """From the first sample to each: trapezoids."""
    parts = 0.5 * np.diff(time)[:, None] * (H[1:] + H[:-1])
    return np.concatenate([np.zeros((1, H.shape[1])), np.cumsum(parts, axis=0)])


def _unsettled(trials: Sequence[Trial]) -> tuple[str, ...]:
    """Warning of trials whose halves have other means."""
    halves = [[float(np.mean(part)) for part in np.array_split(trial.state, 2)] for trial in trials]
    far = [abs(a - b) > _SETTLED * np.sqrt(np.mean(t.state**2)) for (a, b), t in zip(halves, trials, strict=True)]
    return (f"not settled: {sum(far)} of {len(trials)} recordings change from half to half",) if any(far) else ()


def follow_recording(trial: Trial, values: Float[np.ndarray, "k"]) -> Float[np.ndarray, "n"]:
    """The motion of a model with these parameters, from the first state of least squares to the samples."""
    what = _arguments(trial)

    def at(x0: Float[np.ndarray, "1"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n k+1"]]:
        states, derivatives = _with_derivatives(*what, np.append(values, x0))
        return np.asarray(states), np.asarray(derivatives)

    how: Any = {"method": "lm", "jac": lambda x0: at(x0)[1][:, -1:]}
    found = least_squares(lambda x0: at(x0)[0] - trial.state, trial.state[:1], **how)
    return at(found.x)[0]


@partial(jax.jit, static_argnums=0)
def _at_samples(
    regressors: Regressors, time: Float[Array, "n"], state: Float[Array, "n"], inputs: tuple[Float[Array, "n"], ...]
) -> Float[Array, "n k"]:
    """H at the samples."""
    return jax.vmap(regressors)(time, state, *inputs)


@partial(jax.jit, static_argnums=0)
def _motion(
    regressors: Regressors,
    time: Float[Array, "n"],
    inputs: tuple[Float[Array, "n-1 s"], ...],
    p: Float[Array, "k+1"],
) -> Float[Array, "n"]:
    """States at the times, by parameters and first state: the classical Runge-Kutta method in quarters of a sample."""
    theta, x0 = p[:-1], p[-1]

    def step(x: Array, ends: tuple[Array, ...]) -> tuple[Array, Array]:
        start, h, *u = ends
        h = h / _STEPS
        for q in range(_STEPS):

            def rate(place: int, x: Array, q: int = q) -> Array:
                return regressors(start + (q + place / 2) * h, x, *(one[2 * q + place] for one in u)) @ theta

            a = rate(0, x)
            b = rate(1, x + h / 2 * a)
            c = rate(1, x + h / 2 * b)
            x = x + h / 6 * (a + 2 * b + 2 * c + rate(2, x + h * c))
        return x, x

    _, states = jax.lax.scan(step, x0, (time[:-1], jnp.diff(time), *inputs))
    return jnp.concatenate([x0[None], states])


@partial(jax.jit, static_argnums=0)
def _with_derivatives(regressors: Regressors, *arguments: Any) -> tuple[Float[Array, "n"], Float[Array, "n k+1"]]:
    """`_motion` of the same arguments, and its derivatives by parameters and first state."""
    *given, p = arguments

    def both(p: Array) -> tuple[Array, Array]:
        x = _motion(regressors, *given, p)
        return x, x

    derivatives, states = jax.jacfwd(both, has_aux=True)(p)
    return states, derivatives

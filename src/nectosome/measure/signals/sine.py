"""Least-squares fit of a sine, with standard errors."""

from typing import Any, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.optimize import least_squares

from .noise import correlation_time
from .requirements import is_even, single
from .spectra import highest_frequency


class ValueWithError(NamedTuple):
    """A value and its standard error."""

    value: float
    se: float


class FittedSine(NamedTuple):
    """offset + amplitude sin(2 pi frequency t + phase)."""

    amplitude: ValueWithError  # above 0, in the signal's unit
    frequency: ValueWithError  # [Hz]
    phase: ValueWithError  # [rad] in (-pi, pi], at time 0
    offset: ValueWithError  # in the signal's unit


def sine(signal: xr.DataArray) -> FittedSine:
    """Fit offset + amplitude sin(2 pi frequency t + phase) by least squares; the dominant sine of several.

    The covariance is s^2 (J^T J)^-1, s^2 = RSS / (n - 4): for white noise that of the Cramer-Rao bound, var(2 pi f h) =
    24 s^2 / (A^2 n (n^2 - 1)), var(A) = 2 s^2 / n (Rife, Boorstyn, IEEE Trans. Inf. Theory 20 (1974) 591, for a real
    signal). For correlated residuals it is multiplied by their `correlation_time`. The phase is that at time 0; its
    error is large if time 0 is far from the samples. Times may be uneven. Raises ValueError for NaN, fewer than 8
    samples, a constant signal, and less than one period.
    """
    time, x = single(signal, "sine", least=8)
    if np.ptp(x) == 0:
        raise ValueError("sine: the signal is constant; there is no sine in it.")
    middle, span = float(time.mean()), float(time[-1] - time[0])
    t = time - middle
    frequency = _start(t, x, span)
    scale = float(x.std())

    def model(p: Float[np.ndarray, "4"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n 4"]]:
        """a cos + b sin + offset and its Jacobian by (a, b, frequency in 1/span, offset)."""
        angle = 2 * np.pi * (frequency + p[2] / span) * t
        c, s = np.cos(angle), np.sin(angle)
        by_frequency = 2 * np.pi * t / span * (p[1] * c - p[0] * s)
        return p[0] * c + p[1] * s + p[3], np.stack([c, s, by_frequency, np.ones_like(t)], axis=1)

    a, b, offset = _linear(t, x / scale, frequency)
    jacobian: Any = lambda p: model(p)[1]  # noqa: E731
    start = [a, b, 0.0, offset]
    fit = least_squares(lambda p: model(p)[0] - x / scale, start, jacobian, method="lm", xtol=1e-12, ftol=1e-12)
    a, b, df, offset = fit.x
    frequency_found = frequency + df / span
    if not frequency_found * span >= 1:
        raise ValueError(
            f"sine: the best sine has {abs(frequency_found) * span:.2g} periods in {span:.6g} s, and at least one is "
            "needed: take a longer stretch, or detrend it first."
        )
    residuals, columns = fit.fun, fit.jac
    variance = residuals @ residuals / (len(t) - 4) * correlation_time(residuals)
    covariance = variance * np.linalg.inv(columns.T @ columns)
    size = float(np.hypot(a, b))
    # a cos + b sin = size sin(angle + atan2(a, b)); the angle at time 0 is -2 pi f middle
    gradients = np.array(
        [
            [a / size, b / size, 0, 0],
            [0, 0, 1 / span, 0],
            [b / size**2, -a / size**2, -2 * np.pi * middle / span, 0],
            [0, 0, 0, 1],
        ]
    )
    se = np.sqrt(np.einsum("ij,jk,ik->i", gradients, covariance, gradients))
    phase = np.arctan2(a, b) - 2 * np.pi * frequency_found * middle
    phase = np.pi - (np.pi - phase) % (2 * np.pi)
    return FittedSine(
        ValueWithError(size * scale, float(se[0]) * scale),
        ValueWithError(float(frequency_found), float(se[1])),
        ValueWithError(float(phase), float(se[2])),
        ValueWithError(float(offset) * scale, float(se[3]) * scale),
    )


def _linear(t: Float[np.ndarray, "n"], x: Float[np.ndarray, "n"], frequency: float) -> Float[np.ndarray, "3"]:
    angle = 2 * np.pi * frequency * t
    columns = np.stack([np.cos(angle), np.sin(angle), np.ones_like(t)])
    return np.linalg.solve(columns @ columns.T, columns @ x)


def _start(t: Float[np.ndarray, "n"], x: Float[np.ndarray, "n"], span: float) -> float:
    """Initial frequency [Hz]: the peak of the spectrum, or a better one near it."""
    even, y = t, x
    if not is_even(t):
        even = np.linspace(t[0], t[-1], len(t))
        y = np.interp(even, t, x)
    guess = highest_frequency(y, span / (len(t) - 1))
    near = guess + np.linspace(-1.5, 1.5, 13) / span  # for few periods the window's main lobe is too wide
    near = near[(near * span >= 0.5) & (near * span < 0.499 * (len(t) - 1))]

    def misfit(f: float) -> float:
        a, b, c = _linear(even, y, f)
        return float(np.sum((a * np.cos(2 * np.pi * f * even) + b * np.sin(2 * np.pi * f * even) + c - y) ** 2))

    return float(min(near, key=misfit))

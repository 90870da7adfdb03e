"""Spectra of signals, and the least-squares fit of a sine, with standard errors."""

from typing import Any, Literal, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.optimize import least_squares
from scipy.signal import get_window, welch

from .metadata import R, RecordedSignal, each, product, with_step
from .noise import correlation_time
from .requirements import even_step, is_even, positive, refuse_nan, single, time_of

_WINDOW = "hann"


def spectrum(recording: R, segment: float | None = None, *, scaling: Literal["density", "amplitude"] = "density") -> R:
    """One-sided spectrum over `frequency` [Hz] by Welch's method: Hann windows that overlap by half, each without mean.

    `segment` [s] is the length of a segment (default: the whole signal); the resolution is 1 / segment.
    "density" is the power spectral density [unit^2/Hz], whose integral over frequency is the variance (Parseval),
    with the standard error

    $$ s / P = \\sqrt{\\tfrac 1K \\left( 1 + 2 \\sum_j (1 - \\tfrac jK) \\rho_j \\right)} \\quad
       \\rho_j = \\left( \\frac{\\sum_k w_k w_{k + jD}}{\\sum_k w_k^2} \\right)^2 $$

    of K segments of Gaussian noise, D apart (Welch, IEEE Trans. Audio Electroacoust. 15 (1967) 70); at the ends of
    the frequency axis it is larger by sqrt(2). "amplitude" is the amplitude of a sine at that frequency [unit],
    without a standard error. Raises ValueError for uneven sampling, nan, and a segment shorter than 8 samples or
    longer than the signal.
    """
    step = even_step(recording, "spectrum")
    if scaling not in ("density", "amplitude"):
        raise ValueError(f'spectrum: scaling is "{scaling}"; it must be "density" or "amplitude".')
    time = time_of(recording, "spectrum")
    n = len(time)
    if segment is not None:
        positive(segment, "segment", "s", "spectrum")
    samples = n if segment is None else round(segment / step)
    if not 8 <= samples <= n:
        raise ValueError(
            f"spectrum: a segment has {samples} samples of {step:.6g} s; it must have 8 to {n}, the length of the "
            "signal."
        )
    frequency = np.fft.rfftfreq(samples, step)
    relative = _relative_se(samples, n)
    doubled = np.full(len(frequency), 2.0)  # one-sided, except at zero and half the rate
    doubled[0] = 1.0
    if samples % 2 == 0:
        doubled[-1] = 1.0

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        refuse_nan(signal.values, name, time, "spectrum")
        kind = "density" if scaling == "density" else "spectrum"
        power = welch(signal.values, 1 / step, _WINDOW, samples, samples // 2, scaling=kind, axis=-1)[1]
        if scaling == "amplitude":
            return RecordedSignal(np.sqrt(doubled * power), None, signal.units)
        unit = None if signal.units is None else product((signal.units, 2), ("Hz", -1))
        return RecordedSignal(power, power * relative * np.sqrt(2 / doubled), unit)

    axis = xr.DataArray(frequency, dims="frequency", name="frequency", attrs={"units": "Hz"})
    settings = {"segment": samples * step, "window": _WINDOW, "scaling": scaling}
    return with_step(each(recording, change, [axis]), "spectrum", **settings)


def dominant_frequency(signal: xr.DataArray) -> float:
    """Frequency [Hz] of a signal's highest power, without its mean; `sine` gives it with a standard error.

    The vertex of the parabola through the logarithm of the highest bin and its neighbours, for the whole signal with a
    Hann window; accurate to 1/100 of a bin for a sine of many periods. Raises ValueError for uneven sampling, NaN,
    fewer than 8 samples, and a constant signal.
    """
    step = even_step(signal, "dominant_frequency")
    _, x = single(signal, "dominant_frequency", least=8)
    if np.ptp(x) == 0:
        raise ValueError("dominant_frequency: the signal is constant; it has no frequency.")
    return highest_frequency(x, step)


def highest_frequency(x: Float[np.ndarray, "n"], step: float) -> float:
    """As `dominant_frequency`, for even samples that are not constant, with four times the bins."""
    length = 4 * len(x)
    power = np.abs(np.fft.rfft((x - x.mean()) * get_window(_WINDOW, len(x)), length)) ** 2
    k = int(np.argmax(power[1:-1])) + 1
    left, top, right = np.log(power[k - 1 : k + 2])
    bend = left - 2 * top + right
    shift = 0.5 * (left - right) / bend if bend < 0 else 0.0
    return float((k + np.clip(shift, -0.5, 0.5)) / (length * step))


def _relative_se(samples: int, n: int) -> float:
    hop = samples - samples // 2
    count = (n - samples) // hop + 1
    w = np.asarray(get_window(_WINDOW, samples))
    total = 1.0
    for j in range(1, min(count, (samples - 1) // hop + 1)):
        rho = (w[: samples - j * hop] @ w[j * hop :] / (w @ w)) ** 2
        total += 2 * (1 - j / count) * float(rho)
    return float(np.sqrt(total / count))


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
    values, errors = (size * scale, frequency_found, phase, offset * scale), se * (scale, 1, 1, scale)
    return FittedSine(*(ValueWithError(float(x), float(e)) for x, e in zip(values, errors, strict=True)))


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

"""Filters without delay: detrending, smoothing and differentiation, zero-phase low-pass, smoothing splines."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from scipy.interpolate import BSpline
from scipy.signal import butter, savgol_coeffs, savgol_filter, sosfiltfilt, zpk2sos
from scipy.sparse import diags_array, eye_array
from scipy.sparse.linalg import spsolve

from .metadata import CORRELATED, SE, R, RecordedSignal, each, errors_independent, product, with_step
from .noise import Weights, filtered_se
from .requirements import even_step, positive, refuse_nan, time_of

_DEGREE = 5
_TRIED = 24  # cut-offs
_NORMAL = 0.6745  # median magnitude of normal noise over its standard deviation
_FAST = 0.25  # of the sampling rate: what is faster is noise
_LEAST, _MOST = 2.0, 0.5  # cut-offs: periods in the whole time at least, and a share of the sampling rate at most


@dataclass(frozen=True)
class ZeroPhase:
    """Two-pass Butterworth low-pass of samples `step` [s] apart: gain 1/sqrt(2) at `cutoff` [Hz] after both passes.

    $$ |H| = \\left[ 1 + (\\sqrt 2 - 1) \\left( \\frac{\\tan \\pi f h}{\\tan \\pi f_c h} \\right)^{2 n} \\right]^{-1} $$

    The cutoff of a single pass is higher accordingly (Winter, Biomechanics and Motor Control of Human Movement, ch. 3).
    Beyond its ends a signal is extended by point reflection, 2 x_0 - x_j, so that the first and last sample do not
    change.
    """

    cutoff: float  # [Hz], below 1 / (2 step)
    order: int  # of each pass
    step: float  # [s]

    @cached_property
    def _zpk(self) -> Any:
        tangent = np.tan(np.pi * self.cutoff * self.step)
        own = np.arctan(tangent / (np.sqrt(2) - 1) ** (0.5 / self.order)) / np.pi  # of one pass, in cycles a sample
        return butter(self.order, 2 * own, output="zpk")

    @cached_property
    def _sos(self) -> Float[np.ndarray, "sections 6"]:
        return np.asarray(zpk2sos(*self._zpk))

    @property
    def reach(self) -> int:
        """Samples after which the impulse response has decayed to 1/1000; a signal must be longer."""
        return int(np.ceil(np.log(1e-3) / np.log(np.max(np.abs(self._zpk[1])))))

    def __call__(self, values: Float[np.ndarray, "*batch n"]) -> Float[np.ndarray, "*batch n"]:
        """Filter along the last axis."""
        rise = np.linspace(0.0, 1.0, values.shape[-1])
        line = values[..., :1] * (1 - rise) + values[..., -1:] * rise  # passes unchanged, without a transient
        return line + sosfiltfilt(self._sos, values - line, axis=-1, padtype="odd", padlen=self.reach)

    @cached_property
    def weights(self) -> Weights:
        """Weights of the samples, truncated where they have decayed."""
        m = self.reach
        impulse = np.zeros(4 * m + 1)
        impulse[2 * m] = 1.0
        kernel = sosfiltfilt(self._sos, impulse, padlen=0)[m : 3 * m + 1]
        h = np.concatenate([kernel[m:], np.zeros(2 * m)])  # h_0, h_1, ...
        tail = 2 * np.cumsum(h[::-1])[::-1]  # 2 (h_i + h_{i+1} + ...)

        def first(i: int) -> Float[np.ndarray, "k"]:
            j = np.arange(i + m + 1)
            row = h[np.abs(i - j)] - h[i + j]
            row[0] = h[i] + tail[i + 1]
            return row

        return Weights(kernel, first)


def detrend(recording: R, kind: Literal["constant", "linear"] = "constant") -> R:
    """Subtract the mean or the least-squares line over time; uneven sampling is allowed.

    Standard errors do not change: they are an upper bound, since the trend removes part of the error. Raises ValueError
    for NaN.
    """
    time = time_of(recording, "detrend")
    degree = {"constant": 0, "linear": 1}.get(kind)
    if degree is None:
        raise ValueError(f'detrend: kind is "{kind}"; it must be "constant" or "linear".')
    t = (time - time.mean()) / (time[-1] - time[0])
    q, _ = np.linalg.qr(np.vander(t, degree + 1))

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        refuse_nan(signal.values, name, time, "detrend")
        return signal._replace(values=signal.values - (signal.values @ q) @ q.T)

    return with_step(each(recording, change), "detrend", kind=kind)


def smooth(recording: R, window: float, *, order: int = 3, derivative: int = 0) -> R:
    """Savitzky-Golay filter: the least-squares polynomial over `window` [s] around each sample, or its derivative.

    Exact for polynomials up to `order`. The window is the nearest odd number of samples; the first and last half window
    use the polynomial of the whole window. `derivative` 1 gives units per second, 2 per second squared. Source:
    Savitzky, Golay, Anal. Chem. 36 (1964) 1627; ends as in `scipy.signal.savgol_filter(mode="interp")`.

    Standard errors follow from the weights of the samples (`filtered_se`): for independent errors in the first filter
    (gain sqrt(sum h^2) away from the ends), as a bound for any correlation after an earlier filter. Raises ValueError
    for uneven sampling, NaN, and a window that is too short for the polynomial or longer than the signal.
    """
    step = even_step(recording, "smooth")
    positive(window, "window", "s", "smooth")
    n, samples = recording.sizes["time"], 2 * round((window / step - 1) / 2) + 1
    if order < 0 or not 0 <= derivative <= order:
        raise ValueError(f"smooth: derivative {derivative} of a polynomial of order {order}; 0 to {order} is possible.")
    if not order + 2 <= samples <= n:
        allowed = (
            f"{(order + 2) * step:.6g} s to {n * step:.6g} s" if n >= order + 2 else f"a signal of {order + 2} samples"
        )
        raise ValueError(
            f"smooth: the window of {window:g} s has {samples} samples of {step:.6g} s, and a polynomial of order "
            f"{order} over {n} samples needs {allowed}."
        )
    time = time_of(recording, "smooth")
    kernel = savgol_coeffs(samples, order, deriv=derivative, delta=step, use="dot")
    weights = Weights(kernel, lambda i: savgol_coeffs(samples, order, deriv=derivative, delta=step, pos=i, use="dot"))
    independent = errors_independent(recording)

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        _refuse_missing(signal, name, time, "smooth")
        values = savgol_filter(signal.values, samples, order, deriv=derivative, delta=step, axis=-1, mode="interp")
        return RecordedSignal(
            np.asarray(values),
            None if signal.se is None else filtered_se(signal.se, weights, independent),
            product((signal.units, 1), ("s", -derivative)) if signal.units and derivative else signal.units,
        )

    settings = {"window": window, "samples": samples, "order": order, "derivative": derivative, "gain": weights.gain}
    return with_step(each(recording, change), "smooth", **settings, **CORRELATED)


def lowpass(recording: R, cutoff: float, *, order: int = 2) -> R:
    """Butterworth low-pass, run forwards and backwards: no delay, gain 1/sqrt(2) at `cutoff` [Hz] (`ZeroPhase`).

    `order` is that of one pass; two passes of order 2 are the usual fourth-order filter. The first and last sample do
    not change, so noise is not reduced there.

    Standard errors as in `smooth`. Raises ValueError for uneven sampling, NaN, a cutoff that is not below half the
    sampling rate, and a signal shorter than the filter's impulse response.
    """
    step = even_step(recording, "lowpass")
    positive(cutoff, "cutoff", "Hz", "lowpass")
    if order < 1:
        raise ValueError(f"lowpass: order is {order}; it must be 1 or more.")
    if cutoff * step >= 0.5:
        raise ValueError(
            f"lowpass: cutoff is {cutoff:g} Hz; it must be below half the sampling rate, {0.5 / step:.6g} Hz."
        )
    filter = ZeroPhase(cutoff, order, step)
    time = time_of(recording, "lowpass")
    n = len(time)
    if n <= filter.reach:
        raise ValueError(
            f"lowpass: the signal has {n} samples, and at {cutoff:g} Hz more than {filter.reach} are needed "
            f"({filter.reach * step:.6g} s): take a longer stretch or a higher cutoff."
        )
    independent = errors_independent(recording)

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        _refuse_missing(signal, name, time, "lowpass")
        se = None if signal.se is None else filtered_se(signal.se, filter.weights, independent)
        return signal._replace(values=filter(signal.values), se=se)

    settings = {"cutoff": cutoff, "order": order, "gain": filter.weights.gain}
    return with_step(each(recording, change), "lowpass", **settings, **CORRELATED)


def _refuse_missing(signal: RecordedSignal, name: str, time: Float[np.ndarray, "n"], function: str) -> None:
    refuse_nan(signal.values, name, time, function)
    if signal.se is not None:
        refuse_nan(signal.se, name + SE, time, function)


def cutoffs(time: Float[np.ndarray, "n"]) -> tuple[float, float]:
    """Least and largest cut-off that samples at these times allow [Hz]."""
    return _LEAST / float(time[-1] - time[0]), _MOST / float(np.median(np.diff(time)))


def smoothing_spline(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], cutoff: float) -> BSpline:
    r"""The smoothing spline with a cut-off $f_c$ [Hz] through samples at increasing times, which need not be even.

    $$ \min_f \sum_i h\, (y_i - f(t_i))^2 + \frac{\sqrt 2 - 1}{(2 \pi f_c)^6} \int f'''^2\, dt $$

    with h the median of the steps of time: a spline of degree 5 (Schoenberg 1964), whose gain away from the ends is
    $1 / (1 + (\sqrt 2 - 1) (f / f_c)^6)$, $1/\sqrt 2$ at the cut-off, without delay; less beyond it, since pieces of
    the spline are a quarter of a period of the cut-off long.
    """
    step, length = float(np.median(np.diff(time))), float(time[-1] - time[0])
    spans = int(np.ceil(length / max(0.25 / cutoff, step)))
    span = length / spans
    knots = time[0] + span * np.arange(-_DEGREE, spans + _DEGREE + 1)
    at, weights = (0.5 + np.sqrt(0.6) / 2 * np.array([-1.0, 0.0, 1.0])), np.array([5.0, 8.0, 5.0]) / 18  # Gauss
    places = (time[0] + span * (np.arange(spans)[:, None] + at)).ravel()
    count = spans + _DEGREE
    thirds = sum(x * eye_array(count - 3, count, k=k) for k, x in enumerate((-1.0, 3.0, -3.0, 1.0)))
    bent = BSpline.design_matrix(places, knots[3:-3], _DEGREE - 3) @ thirds / span**3
    near = BSpline.design_matrix(np.minimum(time, knots[-_DEGREE - 1]), knots, _DEGREE)
    penalty = (np.sqrt(2) - 1) / (2 * np.pi * cutoff) ** 6 / step * span
    square = near.T @ near + penalty * (bent.T @ diags_array(np.tile(weights, spans)) @ bent)
    return BSpline(knots, spsolve(square.tocsc(), near.T @ values), _DEGREE)


def cutoff_of(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], noise: float, independent: int | None = None
) -> float:
    r"""The cut-off that comes closest to what values without their noise are, by Stein's unbiased estimate [Hz].

    $$ \overline{(f - y)^2} + 2 \sigma^2 \frac{n}{m} \overline H $$

    with noise of the standard deviation $\sigma$, of which m values are `independent` (all unless given), and the mean
    H of the gain over frequencies (Stein 1981, Annals of Statistics 9, 1135).
    """
    step, shares = float(np.median(np.diff(time))), values.size / max(independent or values.size, 1)

    def risk(cutoff: float) -> float:
        left = np.mean((smoothing_spline(time, values, cutoff)(time) - values) ** 2)
        return float(left + 2 * noise**2 * shares * np.mean(_gain(cutoff * step)))

    low, high = cutoffs(time)
    return min(np.geomspace(low, high, _TRIED).tolist(), key=risk)


def noise_of(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"]) -> float:
    """Standard deviation of white noise, by what is faster than a quarter of the sampling rate."""
    left = values - smoothing_spline(time, values, _FAST / float(np.median(np.diff(time))))(time)
    return float(np.median(np.abs(left)) / _NORMAL / np.sqrt(np.mean((1 - _gain(_FAST)) ** 2)))


def _gain(cutoff: float) -> Float[np.ndarray, "f"]:
    """Gain at frequencies up to half the sampling rate, with a cut-off as a share of that rate."""
    return 1 / (1 + (np.sqrt(2) - 1) * (np.linspace(0.0, 0.5, 501) / cutoff) ** 6)

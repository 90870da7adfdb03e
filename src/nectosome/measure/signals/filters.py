"""Filters without delay: detrending, smoothing and differentiation, zero-phase low-pass."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np
from jaxtyping import Float
from scipy.signal import butter, savgol_coeffs, savgol_filter, sosfiltfilt, zpk2sos

from .metadata import CORRELATED, SE, R, RecordedSignal, each, errors_independent, product, with_step
from .noise import Weights, filtered_se
from .requirements import even_step, positive, refuse_nan, time_of


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

"""Spectra of signals."""

from typing import Literal

import numpy as np
import xarray as xr
from jaxtyping import Float
from scipy.signal import get_window, welch

from .metadata import R, RecordedSignal, each, product, with_step
from .requirements import even_step, positive, refuse_nan, single, time_of

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

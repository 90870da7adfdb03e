"""A notch for hum: what a signal has at one frequency, found piece by piece, is taken off."""

import numpy as np
from jaxtyping import Float

from .metadata import R, RecordedSignal, each, with_step
from .requirements import positive, refuse_nan, time_of

_PERIODS = 50.0  # of the hum in a piece: 1 s of that of the mains
_LEAST = 10.0  # periods in a piece, as they look at the sampling rate: far above what a robot does
_DEGREE = 5  # of the polynomial that stands for the signal itself within a piece
_SAMPLES = 16  # in a piece: it has eight unknowns
_LONG = 1.5  # [median step], from which on samples are lost


def notch(recording: R, frequency: float) -> R:
    r"""Take off hum of a frequency f [Hz], as of the mains: a notch about f/50 wide.

    In pieces of 50 periods, which overlap by half, a least-squares fit under a Hann window

    $$ y(t) \approx c \cos 2 \pi f t + s \sin 2 \pi f t + \sum_{k=0}^{5} a_k t^k $$

    gives the hum; c and s are linear from the middle of a piece to that of the next one. So it may grow and drift, and
    samples need not be even. Hum above half of the sampling rate looks slower than it is, and is taken off as well.
    Standard errors do not change: they are an upper bound.

    Raises ValueError for NaN, for less than 50 periods, and where hum looks so slow that the signal itself would go.
    """
    time = time_of(recording, "notch")
    positive(frequency, "frequency", "Hz", "notch")

    def change(name: str, signal: RecordedSignal) -> RecordedSignal:
        refuse_nan(signal.values, name, time, "notch")
        try:
            hum = np.apply_along_axis(lambda row: hum_of(time, row, frequency), -1, signal.values)
        except ValueError as error:
            raise ValueError(f"notch: {error}") from None
        return signal._replace(values=signal.values - hum)

    return with_step(each(recording, change), "notch", frequency=frequency)


def looks_like(time: Float[np.ndarray, "n"], frequency: float) -> float:
    """Frequency as which another one is seen at the usual step between samples [Hz]."""
    cycles = frequency * usual_step(time)
    return abs(cycles - round(cycles)) / cycles * frequency


def usual_step(time: Float[np.ndarray, "n"]) -> float:
    """Mean step between samples without those that are much longer [s]: a clock of whole milliseconds has no other."""
    steps = np.diff(time)
    return float(steps[steps <= _LONG * np.median(steps)].mean())


def hum_of(time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], frequency: float) -> Float[np.ndarray, "n"]:
    """Hum of a frequency [Hz] in values at increasing times (see `notch`); values that are NaN are left out.

    Raises ValueError for times that are too short, and at which it looks too slow.
    """
    piece = _PERIODS / frequency
    if time.size < 2 or time[-1] - time[0] < piece:
        raise ValueError(f"{frequency:g} Hz are found in {piece:g} s and more, and the signal is shorter.")
    seen = looks_like(time, frequency)
    if seen * piece < _LEAST:
        rate = 1 / usual_step(time)
        raise ValueError(
            f"{frequency:g} Hz look like {seen:.3g} Hz in samples taken at {rate:.4g} Hz, and cannot be told from what "
            "is measured. Sample at another rate."
        )
    known = np.isfinite(values)
    t, y = time[known], values[known]
    count = int(np.ceil((time[-1] - time[0]) / (0.5 * piece))) - 1
    middles, waves = np.linspace(time[0] + 0.5 * piece, time[-1] - 0.5 * piece, max(count, 1)), list[np.ndarray]()
    for middle in middles:
        near = slice(*np.searchsorted(t, [middle - 0.5 * piece, middle + 0.5 * piece]))
        x = (t[near] - middle) / piece
        if x.size < _SAMPLES:
            waves.append(np.full(2, np.nan))  # a gap: as beside it
            continue
        phase, window = 2 * np.pi * frequency * t[near], np.cos(np.pi * x)
        basis = np.column_stack([np.cos(phase), np.sin(phase), np.vander(2 * x, _DEGREE + 1)])
        waves.append(np.linalg.lstsq(basis * window[:, None], y[near] * window)[0][:2])
    found = np.stack(waves)
    there = np.isfinite(found[:, 0])
    if not there.any():
        raise ValueError(f"{frequency:g} Hz cannot be found: no {piece:g} s have {_SAMPLES} samples.")
    cosine, sine = (np.interp(time, middles[there], of[there]) for of in found.T)
    return cosine * np.cos(2 * np.pi * frequency * time) + sine * np.sin(2 * np.pi * frequency * time)

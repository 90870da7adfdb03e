r"""Frequency and damping ratio of a vibration about a mean that creeps.

$$ z = m + c\, e^{-t/T} + e^{-\zeta\omega t} (a \cos\omega t + b \sin\omega t), \quad \omega = 2\pi f $$
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.identification import fit

_SPREAD = 0.2  # of the range of the frequency, about that of the crossings


class Ringing(NamedTuple):
    """Numbers with their 95 % intervals."""

    frequency: float  # damped [Hz]
    frequency_interval: tuple[float, float]
    damping_ratio: float
    damping_interval: tuple[float, float]


def ringing(time: Float[np.ndarray, "n"], height: Float[np.ndarray, "n"]) -> Ringing:
    """Least squares over what is given [s, m]."""
    swing = float(np.ptp(height))
    level = height - np.poly1d(np.polyfit(time, height, 2))(time)
    crossings = np.flatnonzero(level[:-1] * level[1:] < 0)
    at = time[crossings] - level[crossings] * np.diff(time)[crossings] / np.diff(level)[crossings]
    first = (len(at) - 1) / (2 * (at[-1] - at[0]))

    def curve(t: np.ndarray, m: float, c: float, T: float, a: float, b: float, f: float, zeta: float) -> np.ndarray:
        w = 2 * np.pi * f
        return m + c * np.exp(-t / T) + np.exp(-zeta * w * t) * (a * np.cos(w * t) + b * np.sin(w * t))

    ranges = {
        "m": (float(height.min()), float(height.max())),
        "c": (-0.5 * swing, 0.5 * swing),
        "T": (0.05, 5.0),
        "a": (-2 * swing, 2 * swing),
        "b": (-2 * swing, 2 * swing),
        "f": (first * (1 - _SPREAD), first * (1 + _SPREAD)),
        "zeta": (0.0, 0.3),
    }
    begin = {"m": float(height[-20:].mean()), "c": 0.0, "T": 0.3, "a": 0.0, "b": 0.0, "f": first, "zeta": 0.05}
    found = fit(curve, time - time[0], height, ranges, start=begin, starts=1)
    ends = [(found.intervals[name].low, found.intervals[name].high) for name in ("f", "zeta")]
    return Ringing(found.values["f"], ends[0], found.values["zeta"], ends[1])

"""Regime at the end of a run: a steady motion, an oscillation, or neither."""

from typing import Literal, NamedTuple

import numpy as np

from nectosome.core import Status

from .results import Run

_STILL = 1e-3  # [largest velocity] amplitude that counts as steady
_ALIKE = 0.98  # autocorrelation of a velocity at one period


class Regime(NamedTuple):
    """Kind of motion at the end of a run."""

    kind: Literal["steady", "oscillating", "irregular", "lost"]
    frequency: float  # [Hz] of an oscillation; else NaN

    def __str__(self) -> str:
        words = {
            "steady": "it settles to a steady motion",
            "oscillating": f"it keeps oscillating at {self.frequency:.3g} Hz (limit cycle)",
            "irregular": "it keeps moving without a period",
            "lost": "the run stops before its end (divergence)",
        }
        return words[self.kind]


def regime_of(run: Run) -> Regime:
    """Regime of the last half of a run, from its velocities at even samples."""
    if int(run.status) != Status.SOLVED:
        return Regime("lost", float("nan"))
    v, time = np.asarray(run.value.state.v), np.asarray(run.value.time)
    size = np.maximum(np.max(np.abs(v), axis=0), 1e-9)
    if np.max(np.ptp(v[3 * time.size // 4 :], axis=0) / size) <= _STILL:
        return Regime("steady", float("nan"))
    v = v[time.size // 2 :]
    widest = v[:, np.argmax(np.std(v, axis=0) / size)]
    lags = np.arange(1, 2 * widest.size // 3)
    alike = np.array([np.corrcoef(widest[:-k], widest[k:])[0, 1] for k in lags])
    below = np.flatnonzero(alike < 0)
    if not below.size:
        return Regime("irregular", float("nan"))
    best = below[0] + int(np.argmax(alike[below[0] :] >= _ALIKE))
    if alike[best] < _ALIKE:
        return Regime("irregular", float("nan"))
    while best + 1 < alike.size and alike[best + 1] > alike[best]:
        best += 1
    return Regime("oscillating", 1 / (lags[best] * (time[1] - time[0])))

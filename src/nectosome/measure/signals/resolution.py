"""Readings in steps that are coarser than what they tell of accelerations, such as an encoder's."""

import numpy as np
from jaxtyping import Float

ROUNDED = 12**-0.5  # root mean square of errors that are even within a step, in steps
_GRID = 0.1  # of a step: how far readings are from its multiples at most, as they are written with few digits
FELT = 0.05  # share of second differences that noise makes, from which on it matters
_LEVELS = 20  # of a range, at least: fewer are a command's, such as of a valve


def resolution(values: Float[np.ndarray, "n"]) -> float:
    """Step whose multiples, from the least one, all values are; 0 where there is none, or it is too fine to matter.

    An error that is even within a step q makes second differences of $q / \\sqrt{2}$.
    """
    known = np.unique(values)
    gaps = np.diff(known)
    if gaps.size == 0 or gaps.min() == 0:
        return 0.0
    single = np.mean(gaps[gaps < 1.5 * gaps.min()])
    multiples = np.concatenate([[0.0], np.cumsum(np.round(gaps / single))])  # errors of digits do not add up over gaps
    step = float((known[-1] - known[0]) / multiples[-1])
    felt = roughness(values, ROUNDED * step) > FELT and multiples[-1] >= _LEVELS
    return step if felt and np.abs(known - known[0] - step * multiples).max() < _GRID * step else 0.0


def roughness(values: Float[np.ndarray, "n"], noise: float) -> float:
    """Share of second differences that white noise of this standard deviation makes (root mean squares)."""
    size = float(np.sqrt(np.mean(np.diff(values, 2) ** 2))) if values.size > 2 else 0.0
    return min(np.sqrt(6) * noise / size, 1.0) if size > 0 else 1.0

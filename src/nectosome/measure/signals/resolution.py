"""Readings in steps that are coarser than what they tell of accelerations, such as an encoder's."""

import numpy as np
from jaxtyping import Float
from scipy.interpolate import UnivariateSpline

_GRID = 0.1  # of a step: how far readings are from its multiples at most, as they are written with few digits
_FELT = 0.05  # share of second differences that steps make, from which on they matter
_LEVELS = 20  # of a range, at least: fewer are a command's, such as of a valve
_DEGREE = 5


def resolution(values: Float[np.ndarray, "n"]) -> float:
    """Step whose multiples, from the least one, all values are; 0 where there is none, or it is too fine to matter.

    An error that is even within a step q makes second differences of $q / \\sqrt{2}$ (root mean square).
    """
    known = np.unique(values)
    gaps = np.diff(known)
    if gaps.size == 0 or gaps.min() == 0:
        return 0.0
    single = np.mean(gaps[gaps < 1.5 * gaps.min()])
    multiples = np.concatenate([[0.0], np.cumsum(np.round(gaps / single))])  # errors of digits do not add up over gaps
    step = float((known[-1] - known[0]) / multiples[-1])
    size = float(np.sqrt(np.mean(np.diff(values, 2) ** 2))) if values.size > 2 else 0.0
    felt = step / np.sqrt(2) > _FELT * size and multiples[-1] >= _LEVELS
    return step if felt and np.abs(known - known[0] - step * multiples).max() < _GRID * step else 0.0


def smoothed_within(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"], step: float
) -> Float[np.ndarray, "n"]:
    """The smoothest curve (spline of degree 5) that is off by what rounding to a `step` makes: $q^2/12$ in the mean.

    Readings at rest are no more exact for being equal: those that differ from a neighbour count alone.
    """
    moves = np.flatnonzero(np.diff(values))
    count = np.union1d(moves, moves + 1).size
    return np.asarray(UnivariateSpline(time, values, k=_DEGREE, s=count * step**2 / 12)(time))

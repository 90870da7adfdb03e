"""How far predictions are from what was measured."""

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import ndtri

from nectosome.units.ranges import Ranges

SIDES = float(ndtri(0.975))  # standard errors to each side of a 95 % interval
CORRELATED = 5.0  # samples over which residuals are correlated: more than noise is by chance
FAR = 3.0  # times the standard error: residuals are larger than noise
_CLEAR = 1e-3  # of the range of what was measured: less is how exactly a model is computed
_AT_BOUND = 1e-4  # of a range
_LEAST = 0.01  # of the largest measured value: a percentage of less says nothing


class Errors(NamedTuple):
    """Errors relative to what was measured, in percent."""

    mean: float  # of |e|/|F|
    signed: float  # mean of e/|F|
    largest: float  # of |e|/|F|
    total: float  # sum of |e| over sum of |F|
    coverage: float  # share of the values in their 95 % intervals; NaN without errors
    floor: float  # what noise alone makes the mean
    small: int  # values below a hundredth of the largest, left out of all but total and coverage


def errors_of(
    predicted: Float[np.ndarray, "n"],
    measured: Float[np.ndarray, "n"],
    error: Float[np.ndarray, "n"],
    noise: Float[np.ndarray, "n"],
) -> Errors:
    r"""Errors e of predictions with standard errors, against measured values F with noise of standard deviation sigma.

    The paper's eq. 30 with magnitudes and the number of values put in. The floor is the mean of
    $\sqrt{2/\pi} \sigma/|F|$; the intervals are those of a measured value, $\pm 1.96 \sqrt{error^2 + \sigma^2}$.
    """
    e, size = predicted - measured, np.abs(measured)
    large = size >= _LEAST * size.max(initial=0.0)
    large &= size > 0
    relative = 100 * e[large] / size[large]
    wide = SIDES * np.hypot(error, noise)
    known = np.isfinite(error)
    return Errors(
        mean=_mean(np.abs(relative)),
        signed=_mean(relative),
        largest=float(np.max(np.abs(relative), initial=0.0)) if large.any() else np.nan,
        total=float(100 * np.sum(np.abs(e)) / np.sum(size)) if size.any() else np.nan,
        coverage=_mean(100.0 * (np.abs(e) <= wide)[known]),
        floor=_mean(100 * np.sqrt(2 / np.pi) * noise[large] / size[large]),
        small=int(np.sum(~large)),
    )


def _mean(x: Float[np.ndarray, "n"]) -> float:
    return float(np.mean(x)) if x.size else float("nan")


def range_errors(model: Float[np.ndarray, "n"], measured: Float[np.ndarray, "n"]) -> tuple[float, float]:
    """Root mean square and largest magnitude of the error, in percent of the range of what was measured."""
    error = np.abs(model - measured)
    scale = 100 / float(np.ptp(measured))
    return scale * float(np.sqrt(np.mean(error**2))), scale * float(error.max())


def held_out_warning(
    predicted: Iterable[tuple[str, Float[np.ndarray, "n"], Float[np.ndarray, "n"], float]],
) -> list[str]:
    """A sentence about the worst prediction, where its root mean square error is far above the standard error.

    Each has a name, predicted and measured values, NaN where there is none, and the standard error.
    """
    off = [(_times_error(model, measured, error), name) for name, model, measured, error in predicted]
    most, name = max(off, default=(0.0, ""))
    if most <= FAR:
        return []
    return [
        f"{name}, held out, is off by {most:.1f} times the standard error: its conditions are unlike those that were "
        "fitted, or the model lacks something; fit a recording of such conditions too, or vary another quantity"
    ]


def _times_error(model: Float[np.ndarray, "n"], measured: Float[np.ndarray, "n"], error: float) -> float:
    """Root mean square of what a prediction is off by, in standard errors; 0 where it is as good as exact."""
    both = np.isfinite(model) & np.isfinite(measured)
    rms = float(np.sqrt(np.mean((model[both] - measured[both]) ** 2))) if both.any() else 0.0
    return rms / error if both.any() and rms > _CLEAR * float(np.ptp(measured[both])) else 0.0


def deviation(measured: Float[np.ndarray, "n"], computed: Float[np.ndarray, "n"]) -> tuple[float, float, float]:
    """Mean, standard deviation and largest magnitude of measured less computed values.

    In percent of the root mean square of the measured ones.
    """
    error = 100 * (measured - computed) / np.sqrt(np.mean(measured**2))
    return float(np.mean(error)), float(np.std(error)), float(np.max(np.abs(error)))


def at_bounds(ranges: Ranges, places: Float[np.ndarray, "n"], units: Sequence[str] = ()) -> list[str]:
    """A sentence for each parameter at an end of its range, by their places in these; with SI units where given."""
    out = []
    for name, place, ends, unit in zip(ranges.names, places, ranges.bounds, units or [""] * len(places), strict=True):
        if not _AT_BOUND < place < 1 - _AT_BOUND:
            side = "lower" if place < 0.5 else "upper"
            end = f"{ends[int(place > 0.5)]:.4g} {unit}".strip()
            out.append(f"{name} is at the {side} end of its range, {end}: widen it, or the model lacks something")
    return out

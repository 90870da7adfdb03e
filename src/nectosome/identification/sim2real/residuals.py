"""What is left between a simulator and experiments, made a function of the conditions in one way or another.

Each way takes what is `Given` and gives a function that corrects the simulator at other conditions.
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import RBFInterpolator

from .alignment import align_inliers, align_points
from .gaussian_process import Surface, Term, gaussian_process
from .parameter import ParameterField


class Simulated(NamedTuple):
    """What a simulator gives at some conditions, with its parameter as told."""

    conditions: Float[np.ndarray, "n d"]
    x: Float[np.ndarray, "n d"]  # in the unit box
    values: Float[np.ndarray, "n"]
    field: Surface  # of the parameter, its u; zeros where none is told
    slopes: Float[np.ndarray, "n"]  # of the values by u


class Given(NamedTuple):
    """What a correction is made of."""

    simulated: Simulated  # where something was measured
    measured: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]
    field: ParameterField | None


_TINY = 1e-100  # sizes below it are none
_ROUGH = 1e-3  # of a simulated value: what time steps, samples and interpolation leave of it

Correction = Callable[[Simulated], Surface]


def nothing(given: Given | None = None) -> Correction:
    """The simulator as it is, with its parameter as told."""
    return lambda there: Surface(there.values, _no_error(there))


def rigid(given: Given) -> Correction:
    r"""Rotation and translation of the points (x, F), simulated to measured (`align_inliers`).

    The paper's $S_T = (M S^T)^T$ (Hu et al. 2024, eq. 29): a point keeps its conditions, though it is moved along them
    too. Values are scaled like the conditions, from the least to the largest simulated one: a rotation mixes them.
    """
    low, size = given.simulated.values.min(), float(np.ptp(given.simulated.values)) or 1.0

    def points(x: Float[np.ndarray, "n d"], values: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n e"]:
        return np.column_stack([x, (values - low) / size])

    x = given.simulated.x
    move, _ = align_inliers(points(x, given.simulated.values), points(x, given.measured))

    def corrected(there: Simulated) -> Surface:
        return Surface(low + size * move(points(there.x, there.values))[:, -1], _no_error(there))

    return corrected


def rigid_raw(given: Given) -> Correction:
    """Rotation and translation as printed: of the points (conditions, F) in SI units, all of them (`align_points`).

    A rotation then mixes radians, hertz and newtons: it depends on their units.
    """

    def points(of: Simulated, values: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n e"]:
        return np.column_stack([of.conditions, values])

    at = given.simulated
    move = align_points(points(at, at.values), points(at, given.measured))
    return lambda there: Surface(move(points(there, there.values))[:, -1], _no_error(there))


def affine(given: Given) -> Correction:
    """A linear function of the conditions and of what is simulated, by least squares.

    Where there are fewer experiments than coefficients, the one that changes least.
    """

    def terms(of: Simulated) -> Float[np.ndarray, "n k"]:
        return np.column_stack([np.ones(len(of.x)), of.x, of.values])

    change, *_ = np.linalg.lstsq(terms(given.simulated), given.measured - given.simulated.values)
    return lambda there: Surface(there.values + terms(there) @ change, _no_error(there))


_SMOOTHING = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)


def thin_plate(given: Given) -> Correction:
    """A thin plate through the differences, as stiff as leaving each of them out asks for (Duchon 1977; Wahba 1990).

    The mean of the differences where they are too few, or lie in a line.
    """
    x, left = given.simulated.x, given.measured - given.simulated.values
    n, d = x.shape
    if n < d + 3 or np.linalg.matrix_rank(np.column_stack([np.ones(n), x])) <= d:
        return lambda there: Surface(there.values + left.mean(), _no_error(there))

    def plate(kept: Bool[np.ndarray, "m"], smoothing: float) -> RBFInterpolator:
        return RBFInterpolator(x[kept], left[kept], smoothing=smoothing, kernel="thin_plate_spline")

    def wrong(smoothing: float) -> float:
        rows = np.arange(n)
        return sum((plate(rows != k, smoothing)(x[[k]])[0] - left[k]) ** 2 for k in rows if _spans(x[rows != k]))

    found = plate(np.ones(n, bool), min(_SMOOTHING, key=wrong))
    return lambda there: Surface(there.values + found(there.x), _no_error(there))


def _spans(x: Float[np.ndarray, "m d"]) -> bool:
    """Whether points are on no line (plane, ...)."""
    return bool(np.linalg.matrix_rank(np.column_stack([np.ones(len(x)), x])) > x.shape[1])


def gaussian(given: Given) -> Correction:
    r"""Gaussian processes of what is left: one that is added, one that scales, and one of the parameter.

    $$ y = F + F' (u - \bar u) + F g_1 + g_2 $$

    with the simulator's values F and slopes F' at the told parameter $\bar u$ (after Kennedy and O'Hagan 2001, whose
    scale is constant). Where something else than y tells u, such as peaks, that is measured too, but doubted: so errors
    of the parameter are counted once, and what does not fit the values counts for little. A thousandth of F is never
    known: a table is no smoother.
    """
    at, field = given.simulated, given.field
    left, rough = given.measured - at.values, _ROUGH * np.abs(at.values)
    size, of = max(_rms(left), float(given.errors.mean()), _TINY), _rms(at.values)
    scale = size / of if of > _TINY else 1.0
    none = np.zeros(0)
    told = (field.x, field.u, field.errors, field.doubt) if field and field.apart else (at.x[:0], none, none, none)
    x, before, after = np.concatenate([told[0], at.x]), np.zeros(len(told[0])), np.ones(len(at.x))
    y = np.concatenate([told[1], left + at.slopes * at.field.mean])
    noise = np.concatenate([told[2], np.hypot(given.errors, rough)])
    doubt = np.concatenate([told[3], 0 * after])

    def corrected(there: Simulated) -> Surface:
        terms = [
            Term(size, np.concatenate([before, after]), np.ones(len(there.x))),
            Term(scale, np.concatenate([before, at.values]), there.values),
        ]
        if field:
            spread = max(_rms(field.u), float(field.errors.mean()), _TINY)
            terms.append(Term(spread, np.concatenate([before + 1, at.slopes]), there.slopes))
        found = gaussian_process(x, y, noise, there.x, terms, doubt)
        mean = there.values - there.slopes * there.field.mean + found.mean
        return Surface(mean, np.hypot(found.error, _ROUGH * np.abs(there.values)))

    return corrected


def _rms(x: Float[np.ndarray, "n"]) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _no_error(there: Simulated) -> Float[np.ndarray, "n"]:
    return np.full(len(there.x), np.nan)

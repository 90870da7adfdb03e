"""Corrections of a simulator: its unknown parameter as a field over the conditions, and the residuals as a function.

Each correction takes what is `Given` and returns a function that corrects the simulator at other conditions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import RBFInterpolator

from nectosome.units import InputError

from .alignment import align_inliers, align_points
from .experiments import Experiments, ParameterEstimate
from .gaussian_process import Surface, Term, gaussian_process
from .grids import GridTable

_DOUBT = 0.1  # of a parameter: how far off an estimate usually may be


@dataclass(frozen=True)
class ParameterField:
    r"""A parameter over the conditions, as $u = \ln\frac{p - p_0}{p_1 - p} - \ln\frac{p_n - p_0}{p_1 - p_n}$.

    The table's ends $p_0$ and $p_1$ are never passed, and u is 0 where the parameter is the nominal $p_n$.
    """

    table: GridTable
    x: Float[np.ndarray, "m d"]  # conditions in the unit box, of experiments that determine it
    u: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # of u
    doubt: Float[np.ndarray, "m"]  # what a tenth of the parameter is of u
    apart: bool

    def at(self, x: Float[np.ndarray, "n d"]) -> Surface:
        """The field u at conditions in the unit box."""
        return gaussian_process(self.x, self.u, self.errors, x)

    def parameter(self, u: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Parameter of a field, and its derivative by u."""
        low, high = self.table.parameter[[0, -1]]
        share = 1 / (1 + np.exp(-u) * (high - self.table.nominal) / (self.table.nominal - low))
        return low + (high - low) * share, (high - low) * share * (1 - share)


def field_of(table: GridTable, experiments: Experiments) -> ParameterField:
    """Field of the table's parameter. Raises InputError where there is none, or where no experiment determines it."""
    if table.parameter.size == 1:
        raise InputError(
            "the simulated grid has no axis of a parameter. Simulate several values of one, or take a method that "
            "needs none, such as gp.",
            field="method",
        )
    estimate = experiments.estimate or matched(table, experiments)
    low, high = table.parameter[[0, -1]]
    known = np.isfinite(estimate.errors) & table.holds(estimate.values)
    if not known.any():
        raise InputError(
            f"no experiment determines it within the simulated grid, {low:g} to {high:g}. Simulate more values of it, "
            "or take a method that needs none, such as gp.",
            field=table.called,
        )
    p, n = estimate.values[known], table.nominal
    u = np.log((p - low) / (high - p)) - np.log((n - low) / (high - n))
    steep = (high - low) / ((p - low) * (high - p))
    x = table.in_box(experiments.conditions[known])
    return ParameterField(table, x, u, steep * estimate.errors[known], steep * _DOUBT * np.abs(p), estimate.apart)


def matched(table: GridTable, experiments: Experiments) -> ParameterEstimate:
    """The parameter with which the simulator gives the measured values themselves."""
    return ParameterEstimate(
        *table.matching(experiments.conditions, experiments.values, experiments.errors), apart=False
    )


class Simulated(NamedTuple):
    """Values of a simulator at some conditions, with its parameter as estimated."""

    conditions: Float[np.ndarray, "n d"]
    x: Float[np.ndarray, "n d"]  # in the unit box
    values: Float[np.ndarray, "n"]
    field: Surface  # of the parameter, its u; zeros where none is estimated
    derivatives: Float[np.ndarray, "n"]  # of the values by u


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
    """The simulator as it is, with its parameter as estimated."""
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
    r"""Gaussian processes of the residuals: one that is added, one that scales, and one of the parameter.

    $$ y = F + F' (u - \bar u) + F g_1 + g_2 $$

    with the simulator's values F and derivatives F' at the estimated parameter $\bar u$ (after Kennedy and O'Hagan
    2001, whose scale is constant). Where u is estimated from something else than y, such as peaks, that is measured
    too, but doubted: so errors of the parameter are counted once, and what does not fit the values counts for little.
    A thousandth of F always stays unknown: a table is no smoother.
    """
    at, field = given.simulated, given.field
    left, rough = given.measured - at.values, _ROUGH * np.abs(at.values)
    size, of = max(_rms(left), float(given.errors.mean()), _TINY), _rms(at.values)
    scale = size / of if of > _TINY else 1.0
    none = np.zeros(0)
    known = (field.x, field.u, field.errors, field.doubt) if field and field.apart else (at.x[:0], none, none, none)
    x, before, after = np.concatenate([known[0], at.x]), np.zeros(len(known[0])), np.ones(len(at.x))
    y = np.concatenate([known[1], left + at.derivatives * at.field.mean])
    noise = np.concatenate([known[2], np.hypot(given.errors, rough)])
    doubt = np.concatenate([known[3], 0 * after])

    def corrected(there: Simulated) -> Surface:
        terms = [
            Term(size, np.concatenate([before, after]), np.ones(len(there.x))),
            Term(scale, np.concatenate([before, at.values]), there.values),
        ]
        if field:
            spread = max(_rms(field.u), float(field.errors.mean()), _TINY)
            terms.append(Term(spread, np.concatenate([before + 1, at.derivatives]), there.derivatives))
        found = gaussian_process(x, y, noise, there.x, terms, doubt)
        mean = there.values - there.derivatives * there.field.mean + found.mean
        return Surface(mean, np.hypot(found.error, _ROUGH * np.abs(there.values)))

    return corrected


def _rms(x: Float[np.ndarray, "n"]) -> float:
    return float(np.sqrt(np.mean(x**2)))


def _no_error(there: Simulated) -> Float[np.ndarray, "n"]:
    return np.full(len(there.x), np.nan)

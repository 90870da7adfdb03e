"""Corrections of a simulator: its unknown parameter as a field over the conditions, and the residuals as a function.

Each correction takes what is `Given` and returns a function that corrects the simulator at other conditions.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations
from math import comb
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.interpolate import RBFInterpolator

from nectosome.units import InputError

from .gaussian_process import Surface, Term, gaussian_process
from .grids import GridTable
from .observe import Experiments, ParameterEstimate

_DOUBT = 0.1  # of a parameter: how far off an estimate usually may be
_TINY = 1e-100  # sizes below it are none
_TRIALS = 500  # subsets of points that are tried where there are more
_SIGMAS = 2.5  # of the scatter: what lies farther off is an outlier
_ROUGH = 1e-3  # of a simulated value: what time steps, samples and interpolation leave of it
_SMOOTHING = (0.0, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 10.0)  # of a thin plate


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
    at, measured, errors = experiments.conditions, experiments.values, experiments.errors
    estimate = experiments.estimate or ParameterEstimate(*table.matching(at, measured, errors), apart=False)
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


Correction = Callable[[Simulated], Surface]


def nothing(given: Given | None = None) -> Correction:
    """The simulator as it is, with its parameter as estimated."""
    return lambda there: Surface(there.values, _no_error(there))


class RigidMap(NamedTuple):
    """x -> rotation x + translation."""

    rotation: Float[np.ndarray, "d d"]
    translation: Float[np.ndarray, "d"]

    def __call__(self, points: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
        """The points moved."""
        return points @ self.rotation.T + self.translation


def align_points(points: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n d"]) -> RigidMap:
    r"""Rotation R and translation T with the least $\sum_k |e_k - (R s_k + T)|^2$, points s to targets e.

    With centred points $H = \sum_k s_k e_k^T = U \Lambda V^T$ (Arun et al. 1987)

    $$ R = V \mathrm{diag}(1, \dots, 1, \det V U^T) U^T, \quad T = \bar e - R \bar s $$

    where the last sign makes a rotation of what would be a reflection (Umeyama 1991; Hu et al. 2024, algorithm 1, gives
    up there). Points of fewer than d - 1 dimensions do not determine R: of all it takes one. All axes count alike:
    scale them first. Raises ValueError without points.
    """
    if len(points) == 0:
        raise ValueError("align_points: no points; at least one is needed.")
    s, e = points.mean(axis=0), targets.mean(axis=0)
    U, _, Vt = np.linalg.svd((points - s).T @ (targets - e))
    signs = np.ones(len(s))
    signs[-1] = np.sign(np.linalg.det(Vt.T @ U.T))
    R = Vt.T @ np.diag(signs) @ U.T
    return RigidMap(R, e - R @ s)


def align_inliers(
    points: Float[np.ndarray, "n d"], targets: Float[np.ndarray, "n d"]
) -> tuple[RigidMap, Bool[np.ndarray, "n"]]:
    r"""`align_points` without outliers, and which points were kept.

    Of the maps that d points each determine, all of them or 500 drawn at random, the one with the least median of
    squares (Rousseeuw 1984), a RANSAC that needs no threshold. Its scatter $1.4826 (1 + 5/(n - d)) \sqrt{\mathrm{med}}$
    is that of normal errors; what is at most 2.5 times as far off is aligned. With fewer than 2 d points all are kept.
    """
    n, d = points.shape
    if n < 2 * d:
        return align_points(points, targets), np.ones(n, bool)
    if comb(n, d) <= _TRIALS:
        subsets = [list(s) for s in combinations(range(n), d)]
    else:
        rng = np.random.default_rng(0)
        subsets = [rng.choice(n, d, replace=False) for _ in range(_TRIALS)]
    far = [np.linalg.norm(targets - align_points(points[k], targets[k])(points), axis=1) for k in subsets]
    best = min(far, key=np.median)
    scatter = 1.4826 * (1 + 5 / (n - d)) * float(np.median(best))
    kept = best <= max(_SIGMAS * scatter, 1e-12 * float(np.abs(targets).max()))
    return align_points(points[kept], targets[kept]), kept


def rigid(given: Given) -> Correction:
    r"""Rotation and translation of the points (x, F), simulated to measured (`align_inliers`).

    The paper's $S_T = (M S^T)^T$ (Hu et al. 2024, eq. 29): a point keeps its conditions, though it is moved along them
    too. Values are scaled like the conditions, from the least to the largest simulated one: a rotation mixes them.
    """
    at = given.simulated
    low, size = at.values.min(), float(np.ptp(at.values)) or 1.0
    move, _ = align_inliers(*(np.column_stack([at.x, (F - low) / size]) for F in (at.values, given.measured)))

    def corrected(there: Simulated) -> Surface:
        moved = move(np.column_stack([there.x, (there.values - low) / size]))
        return Surface(low + size * moved[:, -1], _no_error(there))

    return corrected


def rigid_raw(given: Given) -> Correction:
    """Rotation and translation as printed: of the points (conditions, F) in SI units, all of them (`align_points`).

    A rotation then mixes radians, hertz and newtons: it depends on their units.
    """
    at = given.simulated
    move = align_points(*(np.column_stack([at.conditions, F]) for F in (at.values, given.measured)))
    return lambda there: Surface(move(np.column_stack([there.conditions, there.values]))[:, -1], _no_error(there))


def affine(given: Given) -> Correction:
    """A linear function of the conditions and of what is simulated, by least squares.

    Where there are fewer experiments than coefficients, the one that changes least.
    """

    def terms(of: Simulated) -> Float[np.ndarray, "n k"]:
        return np.column_stack([np.ones(len(of.x)), of.x, of.values])

    change, *_ = np.linalg.lstsq(terms(given.simulated), given.measured - given.simulated.values)
    return lambda there: Surface(there.values + terms(there) @ change, _no_error(there))


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

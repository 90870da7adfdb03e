r"""Curves y = f(x; theta) fitted to arrays by least squares within ranges, with intervals and warnings.

$$ \min_\theta \sum_k \left( \frac{f(x_k; \theta) - y_k}{\sigma_k} \right)^2, \quad
\Sigma = s^2 (J^T J)^{-1}, \quad s^2 = \chi^2 / (m - n) $$

with m values, n parameters and the Jacobian J of the residuals by the parameters; s is 1 where standard errors
$\sigma_k$ are given.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float
from numpy.typing import ArrayLike
from scipy.special import ndtri, stdtrit
from scipy.stats import qmc

from nectosome.designs.design import STARTS
from nectosome.measure.signals.noise import correlation_time
from nectosome.units import InputError, check_names, kind_of, read_numbers, shorten
from nectosome.units.ranges import Ranges, split_range

from .errors import CORRELATED, at_bounds
from .identifiability import Identifiability, Interval, identifiability
from .misfit import Misfit

if TYPE_CHECKING:
    import xarray as xr

Curve = Callable[..., ArrayLike]  # (x, **theta) -> y
_STEP = 1e-5  # of finite differences, as a share of a range: curves are smooth
_OFTEN = 3.0  # times the standard error that was given: residuals are larger than noise
_EXACT = 1e-9  # of the values: stands for the standard error where the curve meets them all


@dataclass(frozen=True, eq=False)
class CurveFit:
    """Parameters of a curve, fitted to values."""

    curve: Curve
    ranges: Ranges
    theta: Float[np.ndarray, "n"]
    covariance: Float[np.ndarray, "n n"]  # of the parameters, as of residuals that are independent
    residuals: Float[np.ndarray, "m"]  # computed less given values
    error: float | None  # standard error of one value, from the residuals; None where errors were given
    identifiability: Identifiability  # counts residuals that are correlated over tau values as so many fewer
    intervals: Mapping[str, Interval]  # 95 %, of the same, by Student's t where errors were not given
    warnings: tuple[str, ...]

    @property
    def values(self) -> dict[str, float]:
        """Parameters by name."""
        return dict(zip(self.ranges.names, self.theta.tolist(), strict=True))

    @property
    def errors(self) -> dict[str, float]:
        """Standard errors by name: roots of the covariance's diagonal."""
        return dict(zip(self.ranges.names, np.sqrt(np.diagonal(self.covariance)).tolist(), strict=True))

    def __call__(self, x: Any) -> np.ndarray:
        """The fitted curve at x."""
        return np.asarray(self.curve(x, **self.values))

    def to_dataset(self) -> "xr.Dataset":
        """Over `parameter`: `value`, `error`, the 95 % interval `low` to `high`, `identifiable`; over `value_number`:
        `residual`; `covariance` over both `parameter` and `parameter_2`; attribute `warnings`."""
        import xarray as xr

        names, ends = list(self.ranges.names), [(one.low, one.high) for one in self.intervals.values()]
        return xr.Dataset(
            {
                "value": ("parameter", self.theta),
                "error": ("parameter", np.array([*self.errors.values()])),
                "low": ("parameter", np.array(ends)[:, 0]),
                "high": ("parameter", np.array(ends)[:, 1]),
                "identifiable": ("parameter", self.identifiability.identifiable),
                "covariance": (("parameter", "parameter_2"), self.covariance),
                "residual": ("value_number", self.residuals),
            },
            {"parameter": names, "parameter_2": names},
            {"warnings": "; ".join(self.warnings)},
        )


def fit(
    curve: Curve,
    x: Any,
    y: ArrayLike,
    vary: Mapping[str, str | Sequence[float]],
    *,
    errors: ArrayLike | None = None,
    start: Mapping[str, float] | None = None,
    jacobian: Callable[..., ArrayLike] | None = None,
    starts: int = STARTS,
) -> CurveFit:
    """Fit a curve to arrays.

        ns.fit(lambda t, a, tau: a * np.exp(-t / tau), t, y, {"a": (0, 2), "tau": "0.01..10 log"})

    - curve(x, **parameters): values in the shape of y; x is handed to it as it is given.
    - y: values; NaN where one is missing. Neighbouring values count as neighbours in time, by which correlation of the
      residuals is judged.
    - vary: parameters and their ranges: two numbers, or text `LOW..HIGH` or `LOW..HIGH log`; all in the units of curve.
    - errors: standard errors of y, one for all or one each; unless given all values have that of the residuals.
    - start: parameters to begin with; others, and all of further `starts`, are spread evenly over the ranges.
    - jacobian(x, **parameters): derivatives of the curve, in the shape of y with one more axis, in the order of `vary`;
      finite differences unless given.

    Raises InputError for values, errors, ranges or a start that make no sense, for fewer values than parameters, and
    where the curve is NaN or infinite at every start.
    """
    check_names(vary, "vary", "{'tau': '0.01..10 log'}")
    ranges, values = _ranges(vary), read_numbers(y, "y")
    for field, function in (("curve", curve), ("jacobian", jacobian)):
        if function is not None:
            _check_function(function, x, ranges.names, field)
    known = ~np.isnan(values)
    given = read_numbers(1.0 if errors is None else errors, "errors")
    if given.ndim and given.shape != values.shape:
        raise InputError(f"has the shape {given.shape}, and y has the shape {values.shape}.", field="errors")
    sigma = np.broadcast_to(given, values.shape)[known]
    m, n = int(known.sum()), len(ranges.names)
    if not np.isfinite(values[known]).all():
        raise InputError("has values that are infinite.", field="y")
    if not (np.isfinite(sigma).all() and (sigma > 0).all()):
        raise InputError("must be finite and more than 0.", field="errors")
    if m < n + (errors is None):
        raise InputError(f"has {m} values, too few for {n} parameters.", field="y")

    def at(row: Float[np.ndarray, "n"], f: Callable[..., ArrayLike], name: str) -> Float[np.ndarray, "m *n"]:
        """Rows of the curve, or of its Jacobian, where y has a value."""
        found = np.asarray(f(x, **dict(zip(ranges.names, row.tolist(), strict=True))), dtype=float)
        if name == "curve" and found.shape != values.shape:
            raise InputError(f"gives the shape {found.shape}, and y has the shape {values.shape}.", field=name)
        if name == "jacobian" and found.shape != (*values.shape, n):
            raise InputError(f"gives the shape {found.shape}; {(*values.shape, n)} is needed.", field=name)
        return found[known]

    def misfit(size: Float[np.ndarray, "m"]) -> Misfit:
        def residuals(rows: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k m"]:
            return np.stack([(at(row, curve, "curve") - values[known]) / size for row in rows])

        by = None if jacobian is None else lambda row, f=jacobian: at(row, f, "jacobian") / size[:, None]
        return Misfit(residuals, ranges, by, _STEP)

    problem = misfit(sigma)
    best = min((problem.fit(begin) for begin in _starts(problem, start or {}, starts)), key=lambda one: one.chi2)
    left = at(best.theta, curve, "curve") - values[known]
    scale = np.sqrt(best.chi2 / (m - n)) if errors is None else 1.0
    scale = max(float(scale), _EXACT * float(np.abs(values[known]).max(initial=0.0)) / float(sigma.max())) or 1.0
    tau = correlation_time(left / sigma, n) if m > n + 1 else 1.0
    places = problem.places(best.theta)
    J = problem.derivatives(places) / ranges.derivatives(best.theta)
    covariance = scale**2 * np.linalg.pinv(J.T @ J, hermitian=True)
    wider = stdtrit(m - n, 0.975) / ndtri(0.975) if errors is None else 1.0
    spread = identifiability(misfit(sigma * scale * np.sqrt(tau)), best.theta)
    intervals = identifiability(misfit(sigma * scale * np.sqrt(tau) * wider), best.theta).intervals()
    often = best.chi2 / m if errors is not None else 0.0
    warnings = _warnings(ranges, places, (spread, intervals), tau, often)
    named = dict(zip(ranges.names, intervals, strict=True))
    error = float(scale * sigma[0]) if errors is None else None
    return CurveFit(curve, ranges, best.theta, covariance, left, error, spread, named, warnings)


def _check_function(function: Any, x: Any, names: Sequence[str], field: str) -> None:
    """Raise InputError unless a function takes x and the parameters by name."""
    if not callable(function):
        raise InputError(
            f"{kind_of(function)} is given where a function of x and of parameters is expected.", field=field
        )
    try:
        inspect.signature(function).bind(x, **dict.fromkeys(names, 0.0))
    except TypeError as error:
        raise InputError(f"cannot be called with x and {', '.join(names)}: {error}.", field=field) from None
    except ValueError:
        return  # compiled functions have no signature


def _ranges(vary: Mapping[str, str | Sequence[float]]) -> Ranges:
    """Ranges of numbers without units. Raises InputError."""
    if not vary:
        raise InputError("is empty: at least one parameter is needed.", field="vary")
    ends, log = list[tuple[float, float]](), list[str]()
    for name, span in vary.items():
        parts = split_range(span) if isinstance(span, str) else None
        try:
            low, high = (float(end) for end in (parts[:2] if parts else span))
        except (TypeError, ValueError):
            raise InputError(f'"{shorten(span)}" is no range. Write LOW..HIGH or two numbers.', field=name) from None
        if not low < high:
            raise InputError(f"{low:g} to {high:g} is empty: the lower end comes first.", field=name)
        ends.append((low, high))
        log += [name] if parts and parts.log else []
    return Ranges(tuple(vary), *zip(*ends, strict=True), log=log)


def _starts(problem: Misfit, start: Mapping[str, float], starts: int) -> Iterable[Float[np.ndarray, "n"]]:
    """Parameters to begin with, those at which the curve is finite. Raises InputError where it is so at none."""
    ranges = problem.ranges
    for name in start:
        problem.index(name)
    middle = ranges.values(np.full(len(ranges.names), 0.5))
    first = np.array([start.get(name, value) for name, value in zip(ranges.names, middle, strict=True)], dtype=float)
    rows = [problem.places(first), *qmc.Halton(len(ranges.names), scramble=False).random(max(starts, 1))[1:]]
    with np.errstate(all="ignore"):
        finite = [np.isfinite(problem.at(row[None])).all() for row in rows]
    if not any(finite):
        raise InputError(f"is NaN or infinite at {ranges.text(first)} and at other starts.", field="curve")
    return [ranges.values(row) for row, good in zip(rows, finite, strict=True) if good]


def _warnings(
    ranges: Ranges,
    places: Float[np.ndarray, "n"],
    told: tuple[Identifiability, Sequence[Interval]],
    tau: float,
    chi2: float,
) -> tuple[str, ...]:
    """What makes a fit doubtful; chi2 is that of one value, where errors were given."""
    out = []
    if tau > CORRELATED:
        out.append(f"residuals are correlated over {tau:.0f} values: the curve lacks something")
    if chi2 > _OFTEN**2:
        out.append(f"residuals are {np.sqrt(chi2):.1f} times their standard errors")
    out += at_bounds(ranges, places)
    spread, intervals = told
    return (*out, *(words for words in spread.words(intervals) if ": identifiable" not in words))

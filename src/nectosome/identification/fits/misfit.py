"""Residuals of a model in standard errors: least squares, and what identifiability and intervals are made of."""

from collections.abc import Callable, Collection, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float
from scipy.optimize import least_squares

from nectosome.core import Block
from nectosome.drives import respond
from nectosome.units import InputError, did_you_mean
from nectosome.units.ranges import Ranges

HUBER = 1.345  # standard errors; of normal noise 95 % of the information is kept
_NORMAL = 1.4826  # standard deviation of normal noise over its median magnitude
_CLOSE = 1e-10  # relative changes at which a fit ends
_ANEW = 20  # fits at most from where one ended whose derivatives were kept
_BLURRED = 0.5  # standard errors: what a step as short changes may be less than how exactly residuals are computed
_BENT = 0.3  # of the change of residuals by a step: with more that was not foreseen derivatives are taken anew


def loss_of(residuals: Float[np.ndarray, "r"], bend: float | None) -> float:
    r"""Sum of squares, or of Huber's loss with a bend b: outliers weigh little.

    $$ \rho(r) = r^2 \ \mathrm{for}\ |r| \le b, \quad b (2 |r| - b)\ \mathrm{beyond} $$

    with residuals in standard errors (Huber 1964, Annals of Mathematical Statistics 35, 73).
    """
    size = np.abs(residuals)
    return float(np.sum(size**2 if bend is None else np.where(size <= bend, size**2, bend * (2 * size - bend))))


def robust_error(residuals: Float[np.ndarray, "r"]) -> float:
    """Standard error of residuals that are normal but for outliers; those that are NaN are left out."""
    return _NORMAL * float(np.nanmedian(np.abs(residuals)))


def robust_width(residuals: Float[np.ndarray, "r"], bend: float) -> float:
    r"""Standard errors of parameters over those of least squares with the standard error of a residual.

    The sandwich of Huber (1967) for residuals of one distribution, in standard errors: $\sqrt{E\,\psi^2}/E\,\psi'$,
    with the influence $\psi$, r between -b and b. NaN where none is within the bend.
    """
    within = np.abs(residuals) <= bend
    if not within.any():
        return float("nan")
    return float(np.sqrt(np.mean(np.clip(residuals, -bend, bend) ** 2)) / np.mean(within))


Residuals = Callable[[Float[np.ndarray, "m n"]], Float[np.ndarray, "m r"]]
Jacobian = Callable[[Float[np.ndarray, "n"]], Float[np.ndarray, "r n"]]


class Fit(NamedTuple):
    """Parameters that make the sum of squared residuals small."""

    theta: Float[np.ndarray, "n"]
    chi2: float


@dataclass(frozen=True)
class Misfit:
    """Residuals of a model whose parameters have ranges.

    - residuals: rows of parameters [m, n] -> differences from the data [m, r], each divided by its standard error.
    - jacobian: parameters [n] -> derivatives of the residuals [r, n]; finite differences unless given, in one batch of
      2 n + 1 rows.
    - step: of finite differences, as a share of the ranges; larger for residuals that are rough.
    - bend: of Huber's loss in standard errors (`loss_of`); least squares unless given.
    - precision: of standard errors, those of the residuals that are left; a fit ends where the next step is shorter by
      exact derivatives. Others are kept from step to step, with what steps say of them (Broyden 1965, Mathematics of
      Computation 19, 577). With 0 all are exact, and a fit ends where nothing changes any more.

    Raises InputError for a range of one value, ValueError for residuals of a wrong shape.
    """

    residuals: Residuals
    ranges: Ranges
    jacobian: Jacobian | None = None
    step: float = 1e-4
    bend: float | None = None
    precision: float = 0.0

    def __post_init__(self):
        for name, (low, high) in zip(self.ranges.names, self.ranges.bounds, strict=True):
            if low == high:
                raise InputError(f"is fixed at {low:g}. Leave it out of the fit.", field=name)
        if not 0 < self.step <= 0.25:
            raise InputError(f"is {self.step:g}; it must be more than 0 and at most 0.25.", field="step")

    def index(self, name: str) -> int:
        """Place of a parameter among the others. Raises InputError for one that there is not."""
        if name not in self.ranges.names:
            raise InputError(f"there is no such parameter.{did_you_mean(name, self.ranges.names)}", field=name)
        return self.ranges.names.index(name)

    def places(self, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
        """Places of parameters in their ranges. Raises InputError outside of them."""
        u = self.ranges.places(theta)
        for k in np.flatnonzero(~((u >= -1e-9) & (u <= 1 + 1e-9))):
            low, high = self.ranges.bounds[k]
            raise InputError(f"{theta[k]:g} is not between {low:g} and {high:g}.", field=self.ranges.names[k])
        return u.clip(0.0, 1.0)

    def at(self, u: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m r"]:
        """Residuals at places in the ranges."""
        r = np.asarray(self.residuals(self.ranges.values(u)), dtype=float)
        if r.ndim != 2 or len(r) != len(u):
            raise ValueError(f"the residuals have the shape {r.shape} for {len(u)} rows of parameters.")
        return r

    def derivatives(self, u: Float[np.ndarray, "n"]) -> Float[np.ndarray, "r n"]:
        """Derivatives of the residuals by the places, from within. Raises InputError where they are NaN or infinite."""
        if self.jacobian is not None:
            x = self.ranges.values(u)
            found = np.asarray(self.jacobian(x), dtype=float) * self.ranges.derivatives(x)
        else:
            found = self._differences(u)
        if not np.isfinite(found).all():
            words = self.ranges.text(self.ranges.values(u))
            raise InputError(f"the residuals, or their derivatives, are NaN or infinite at or near {words}.")
        return found

    def fit(
        self,
        theta: Float[np.ndarray, "n"],
        fixed: Collection[str] = (),
        shift: Float[np.ndarray, "r"] | float = 0.0,
        gain: float = 0.0,
        reached: Callable[[Float[np.ndarray, "n"], float], object] | None = None,
    ) -> Fit:
        """Least squares of residuals plus a shift within the ranges, from parameters on, some of them fixed.

        A local minimum; or what is found when a step gains less than `gain` of chi2, or no more is to be had. `reached`
        is called with the parameters after each step, and their chi2. Raises InputError where residuals are NaN or
        infinite at the start.
        """
        free = np.array([name not in fixed for name in self.ranges.names])
        start = self.places(theta)

        def whole(part: np.ndarray) -> np.ndarray:
            u = start.copy()
            u[free] = part
            return u

        def residuals(part: np.ndarray) -> np.ndarray:
            return self.at(whole(part)[None])[0] + shift

        first = residuals(start[free])
        if not np.isfinite(first).all():
            raise InputError(f"the residuals are NaN or infinite at {self.ranges.text(self.ranges.values(start))}.")
        before = loss_of(first, self.bend)
        if before < gain or not free.any():
            return Fit(self.ranges.values(start), before)

        def enough(intermediate_result: Any) -> None:
            nonlocal before
            chi2 = 2 * float(intermediate_result.cost)
            if reached is not None:
                reached(self.ranges.values(whole(intermediate_result.x)), chi2)
            if min(before - chi2, chi2) < gain:
                raise StopIteration
            before = chi2

        how: Any = {"bounds": (0.0, 1.0), "callback": enough, "xtol": _CLOSE, "ftol": _CLOSE, "gtol": _CLOSE}
        how |= {} if self.bend is None else {"loss": "huber", "f_scale": self.bend}
        exact = lambda part: self.derivatives(whole(part))[:, free]  # noqa: E731
        if self.precision == 0:
            found = least_squares(residuals, start[free], **how | {"jac": exact})
            return Fit(self.ranges.values(whole(found.x)), 2 * float(found.cost))
        kept = _KeptDerivatives(residuals, exact, self.precision, self.bend)
        part = start[free]
        for _ in range(_ANEW):
            kept.at = np.zeros(0)
            with suppress(_CloseError):
                least_squares(kept.residuals, part, **how | {"jac": kept.derivatives})
            part = kept.at
            if kept.exact or gain > 0:  # a rough fit ends where derivatives that were kept say so
                break
        return Fit(self.ranges.values(whole(part)), loss_of(kept.left, self.bend))

    def _differences(self, u: Float[np.ndarray, "n"]) -> Float[np.ndarray, "r n"]:
        """Central differences; where a bound is near, those of a parabola through three points on the inner side."""
        n, h = len(u), self.step
        side = np.where(u + h > 1, -1.0, np.where(u - h < 0, 1.0, 0.0))
        near, far = np.where(side == 0, 1.0, side), np.where(side == 0, -1.0, 2 * side)
        rows = np.concatenate([u[None], u + h * np.diag(near), u + h * np.diag(far)])
        r = self.at(rows)
        middle, one, two = r[:1], r[1 : n + 1], r[n + 1 :]
        central = np.where(side[:, None] == 0, one - two, near[:, None] * (4 * one - two - 3 * middle))
        return central.T / (2 * h)


class _CloseError(Exception):
    """The next step of a fit is shorter than matters."""


class _KeptDerivatives:
    """Residuals and derivatives for `least_squares`, which asks for these where a step was taken."""

    def __init__(self, residuals: Any, exact: Any, precision: float, bend: float | None):
        self._residuals, self._exact, self._precision, self._bend = residuals, exact, precision, bend
        self.at, self.left, self.by = np.zeros(0), np.zeros(0), np.zeros((0, 0))  # parameters and what is there
        self._tried = dict[bytes, np.ndarray]()
        self.exact = False  # whether the derivatives are those of where it is

    def residuals(self, part: np.ndarray) -> np.ndarray:
        """Residuals. Raises _CloseError for a step that is too short to matter, or to tell after one that failed."""
        if self.at.size:
            change = self.by @ (part - self.at)
            least = _BLURRED if len(self._tried) > 1 else self._precision
            if change @ change < least**2 * loss_of(self.left, self._bend) / self.left.size:
                raise _CloseError
        self._tried[part.tobytes()] = self._residuals(part)
        return self._tried[part.tobytes()]

    def derivatives(self, part: np.ndarray) -> np.ndarray:
        """Derivatives there: exact ones where a step was not as they foresaw."""
        left = self._tried[part.tobytes()]
        if self.at.size:
            step = part - self.at
            foreseen = self.by @ step
            missed = left - self.left - foreseen
            self.exact = float(missed @ missed) > _BENT**2 * float(foreseen @ foreseen)
            self.by = self._exact(part) if self.exact else self.by + np.outer(missed, step) / (step @ step)
        else:
            self.by, self.exact = self._exact(part), True
        self.at, self.left, self._tried = part.copy(), left, {part.tobytes(): left}
        return self.by


class Response(NamedTuple):
    """What went into something and what came out of it, at even times, from rest."""

    name: str
    dt: float  # [s]
    input: Float[np.ndarray, "n *channels"]
    output: Float[np.ndarray, "n"]
    standard_error: float  # of the output, in its unit
    begin: int = 0  # samples from here on count; what comes before only brings the block to its state


def output_misfit(
    build: Callable[[Float[Array, "p"]], Block],
    ranges: Ranges,
    responses: Sequence[Response],
    hold: Literal["first", "zero"] = "first",
) -> Misfit:
    """Output errors of the block that `build` makes of parameters, with an exact Jacobian.

    What a fit, its identifiability, profiles and Levenberg-Marquardt take. Raises InputError for recordings whose
    lengths differ, with NaN or infinite samples, or without a standard error above 0.
    """
    for one in responses:
        if len(one.input) != len(one.output):
            raise InputError(f"{len(one.input)} inputs and {len(one.output)} outputs.", field=one.name)
        if not 0 <= one.begin < len(one.output):
            raise InputError(f"counts from sample {one.begin} on, and has {len(one.output)}.", field=one.name)
        if not (np.isfinite(one.input).all() and np.isfinite(one.output).all()):
            raise InputError("has samples that are NaN or infinite.", field=one.name)
        if not one.standard_error > 0:
            raise InputError(f"the standard error is {one.standard_error:g}; it must be more than 0.", field=one.name)
    if not responses:
        raise InputError("there is no recording to fit.", field="responses")

    def residuals(theta: Array) -> Array:
        block = build(theta)
        parts = [
            (respond(block, jnp.asarray(one.input), one.dt, hold) - one.output)[one.begin :] / one.standard_error
            for one in responses
        ]
        return jnp.concatenate(parts)

    several: Any = jax.jit(jax.vmap(residuals))
    jacobian: Any = jax.jit(jax.jacfwd(residuals))
    return Misfit(lambda rows: np.asarray(several(rows)), ranges, lambda theta: np.asarray(jacobian(theta)))

r"""Which parameters data tell, which they tell only together or not at all, and what would help most to measure.

All is to first order in the residuals r of a fit, in standard errors, with parameters as places u in their ranges, on a
logarithmic scale where the range has one. The information of the data is $F = J^T J$, $J = dr/du$. Their only
companion is the range itself, which knows a number as a standard deviation of $1/\sqrt{12}$ does: the covariance is
$(F + 12 I)^{-1}$. What has in it a standard error of less than a stated share of the range counts as told.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtri

from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .errors import SIDES
from .misfit import Misfit

if TYPE_CHECKING:
    import xarray as xr

_RANGE = 12.0  # information that a range of length 1 has of its own
_NOTHING = 0.95  # of the error that the range alone leaves: as much is left where data tell nothing
_COUPLED = 0.1  # entry of the projection onto what is untold: as much makes two parameters belong together
_SMALL = 0.05  # weight in a combination that is not written
_WRITTEN = 3  # parameters of a combination at most that is written out
_FLAT = 1e-6  # information below which an interval is wider than any range


class Interval(NamedTuple):
    """Two ends between which a parameter lies; an end that data do not tell is the bound."""

    low: float
    high: float
    below: bool  # whether data tell the lower end
    above: bool  # and the upper one

    @property
    def text(self) -> str:
        """The interval in words."""
        untold = [side for side, told in (("below", self.below), ("above", self.above)) if not told]
        if len(untold) == 2:
            return "not told"
        return f"{self.low:.4g} to {self.high:.4g}" + "".join(f", not told from {side}" for side in untold)


def intervals_of(ends: Float[np.ndarray, "n 2"], told: Bool[np.ndarray, "n 2"]) -> tuple[Interval, ...]:
    """Intervals by their ends, and whether data tell these."""
    return tuple(Interval(float(a), float(b), bool(x), bool(y)) for (a, b), (x, y) in zip(ends, told, strict=True))


@dataclass(frozen=True, eq=False)
class Identifiability:
    """What data tell of parameters, by their information."""

    ranges: Ranges
    theta: Float[np.ndarray, "n"]
    root: Float[np.ndarray, "n n"]  # R of F = R^T R: as exact as the slopes are, which F is not
    share: float  # of a range: what has a smaller standard error counts as told

    @property
    def eigenvalues(self) -> Float[np.ndarray, "n"]:
        """Information of each direction, the largest first."""
        return self._decomposed[0] ** 2

    @property
    def directions(self) -> Float[np.ndarray, "n n"]:
        """Directions in the box of the ranges, one a row, the one told best first."""
        return self._decomposed[1]

    @property
    def errors(self) -> Float[np.ndarray, "n"]:
        """Standard errors of the parameters, as shares of their ranges: 0.29 where nothing is told."""
        return np.sqrt(self.directions.T**2 @ (1 / (self.eigenvalues + _RANGE)))

    @property
    def told(self) -> Bool[np.ndarray, "n"]:
        """Which parameters are told, each on its own."""
        return self.errors < self.share

    @property
    def rank(self) -> int:
        """How many directions are told."""
        return int(np.sum(1 / np.sqrt(self.eigenvalues + _RANGE) < self.share))

    @property
    def parameters(self) -> float:
        r"""How many parameters are told, in parts: $\sum \lambda / (\lambda + 12)$, the trace of what data add."""
        return float(np.sum(self.eigenvalues / (self.eigenvalues + _RANGE)))

    def intervals(self, coverage: float = 0.95) -> tuple[Interval, ...]:
        r"""Intervals by the data alone: normal on their scales with $F^{-1}$ (Laplace), cut at the bounds."""
        u, wide = self.ranges.places(self.theta), ndtri(0.5 + coverage / 2)
        half = wide * np.sqrt(self.directions.T**2 @ (1 / np.maximum(self.eigenvalues, _FLAT)))
        ends = self.ranges.values(np.clip([u - half, u + half], 0.0, 1.0))
        return intervals_of(ends.T, np.stack([u - half > 0, u + half < 1], axis=1))

    def words(self) -> list[str]:
        """A sentence for each parameter, or for those that are told only together."""
        error = SIDES * self.errors * self.ranges.slopes(self.theta)
        value = [f"{x:.4g} +- {e:.2g}" for x, e in zip(self.theta, error, strict=True)]
        names = self.ranges.names
        out = [f"{names[k]}: told, {value[k]} at 95 %" for k in np.flatnonzero(self.told)]
        for group in self._groups():
            called = " and ".join(filter(None, [", ".join(names[k] for k in group[:-1]), names[group[-1]]]))
            combinations = self._combinations(group)
            if len(group) > _WRITTEN and combinations:
                out.append(f"{called}: only together, {len(combinations)} of {len(group)} combinations told")
            elif len(group) > 1 and combinations:
                out.append(f"{called}: only together, {', '.join(combinations)}")
            elif all(self.errors[k] > _NOTHING / np.sqrt(_RANGE) for k in group):
                out.append(f"{called}: not told at all")
            else:
                hardly = ", ".join(value[k] for k in group)
                out.append(f"{called}: hardly told, {hardly} at 95 %")
        return out

    def to_dataset(self) -> "xr.Dataset":
        """All of it: over `parameter`, and over `direction`, the one told best first."""
        import xarray as xr

        return xr.Dataset(
            {
                "value": ("parameter", self.theta),
                "error": ("parameter", self.errors, {"long_name": "standard error, as a share of the range"}),
                "told": ("parameter", self.told),
                "eigenvalue": ("direction", self.eigenvalues),
                "weight": (("direction", "parameter"), self.directions),
            },
            {"parameter": np.array(self.ranges.names, dtype=str)},
            {"rank": self.rank, "share": self.share},
        )

    @cached_property
    def _decomposed(self) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n n"]]:
        """Singular values and right singular vectors of R."""
        return np.linalg.svd(self.root)[1:]

    @property
    def _untold(self) -> Float[np.ndarray, "n n"]:
        """Projection onto what is not told; the same however directions of equal information are chosen."""
        rest = self.directions[self.rank :]
        return rest.T @ rest

    def _groups(self) -> list[list[int]]:
        """Parameters that are not told, those together that what is untold couples."""
        left, groups = [int(k) for k in np.flatnonzero(~self.told)], []
        while left:
            group, left = [left[0]], left[1:]
            for k in group:  # grows while it is gone through
                joined = [i for i in left if abs(self._untold[k, i]) > _COUPLED]
                group += joined
                left = [i for i in left if i not in joined]
            groups.append(sorted(group))
        return groups

    def _combinations(self, group: list[int]) -> list[str]:
        """What is told of a group: products of powers of parameters on logarithmic scales, else sums."""
        size, weights = np.linalg.eigh(np.eye(len(group)) - self._untold[np.ix_(group, group)])
        width = (self.ranges.ends[:, 1] - self.ranges.ends[:, 0])[group]
        names, log = [self.ranges.names[k] for k in group], self.ranges.log[group]
        out = []
        for weight in (weights / width[:, None]).T[size > 0.5]:
            weight = weight / weight[np.argmax(np.abs(weight * width))]
            kept = [k for k in range(len(group)) if abs(weight[k] * width[k]) > _SMALL * np.abs(weight * width).max()]
            if log.all():
                out.append(" ".join(_power(names[k], weight[k]) for k in kept))
            else:
                terms = [f"{weight[k]:+.2g} {f'ln {names[k]}' if log[k] else names[k]}" for k in kept]
                out.append(" ".join(terms))
        return out


def identifiability(misfit: Misfit, theta: Float[np.ndarray, "n"], share: float = 0.1) -> Identifiability:
    """What data tell of parameters near theta; what has a standard error of less than `share` of its range is told.

    Raises InputError for a share that is not between 0 and 0.28, for parameters outside of their ranges, and where
    residuals are no numbers.
    """
    if not 0 < share <= 0.28:
        raise InputError(f"is {share:g}; it must lie between 0 and 0.28, what a range alone leaves.", field="share")
    return Identifiability(misfit.ranges, np.asarray(theta, dtype=float), _root(misfit, theta), share)


class Helpful(NamedTuple):
    """What another measurement would add to what is told."""

    name: str
    gain: float  # how many parameters more are told, in parts
    told: tuple[str, ...]  # parameters that are told then, and were not before
    after: Identifiability  # with it

    @property
    def text(self) -> str:
        """The gain in words."""
        told = f"; then told: {', '.join(self.told)}" if self.told else ""
        return (
            f"{self.name}: {self.gain:+.2f} parameters, {self.after.rank} of {len(self.after.theta)} directions{told}"
        )


def most_helpful(known: Identifiability, candidates: Mapping[str, Misfit]) -> list[Helpful]:
    r"""Measurements that might be made too, each alone with what is known, the most helpful first.

    The gain is that of $\sum \lambda / (\lambda + 12)$ (`parameters`): knowing better what is known counts little.
    Residuals of a candidate are those of its expected standard errors; their values do not matter, only their slopes.
    Raises InputError for a candidate with other parameters or ranges.
    """
    out = []
    for name, misfit in candidates.items():
        same = misfit.ranges.names == known.ranges.names and np.array_equal(misfit.ranges.ends, known.ranges.ends)
        if not same:
            raise InputError("has other parameters or ranges than what is known.", field=name)
        root = np.linalg.qr(np.concatenate([known.root, _root(misfit, known.theta)])).R
        after = Identifiability(known.ranges, known.theta, root, known.share)
        told = tuple(known.ranges.names[k] for k in np.flatnonzero(after.told & ~known.told))
        out.append(Helpful(name, after.parameters - known.parameters, told, after))
    return sorted(out, key=lambda one: -one.gain)


def _root(misfit: Misfit, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n n"]:
    """R of the information R^T R of a misfit's data."""
    n = len(theta)
    return np.linalg.qr(np.concatenate([misfit.slopes(misfit.places(theta)), np.zeros((n, n))])).R


def _power(name: str, exponent: float) -> str:
    shown = f"{exponent:.2g}"
    return name if shown == "1" else f"{name}^{shown}"

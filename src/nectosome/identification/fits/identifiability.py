r"""Which parameters data identify, alone, only in combination or not at all, and which measurement would help most.

All is to first order in the residuals r of a fit, in standard errors, with parameters as places u in their ranges, on a
logarithmic scale where the range has one. The information of the data is $F = J^T J$, $J = dr/du$. The range itself
adds the information of an even distribution, whose standard deviation is $1/\sqrt{12}$: the covariance is
$(F + 12 I)^{-1}$. A parameter whose standard error is less than a stated share of its range counts as identifiable.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import ndtri

from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .misfit import Misfit

if TYPE_CHECKING:
    import xarray as xr

RANGE = 12.0  # information that a range of length 1 has of its own
_NOTHING = 0.95  # of the error that the range alone leaves: data add nothing where as much is left
_COUPLED = 0.1  # entry of the projection onto what is not identifiable: as much couples two parameters
_SMALL = 0.05  # weight in a combination, below which it is not written
_WRITTEN = 3  # parameters of a combination at most that is written out
_CORRELATED = 0.95  # of errors of two parameters: they are told
_APART = ". Give one of them a value measured on its own, or compare a reading that tells them apart"
_UNMOVED = ": what was compared does not change with it. Compare a reading that does, or leave it out"
_MORE = ". Record longer, with less noise, or a motion that depends more on it"
_FLAT = 1e-6  # information below which an interval is wider than any range


class Interval(NamedTuple):
    """Two ends between which a parameter lies; an end that data do not identify is the bound."""

    low: float
    high: float
    below: bool  # whether data identify the lower end
    above: bool  # and the upper one

    @property
    def text(self) -> str:
        """The interval in words."""
        open_sides = [side for side, known in (("below", self.below), ("above", self.above)) if not known]
        if len(open_sides) == 2:
            return "not identifiable"
        return f"{self.low:.4g} to {self.high:.4g}" + "".join(f", not identifiable from {side}" for side in open_sides)


def intervals_of(ends: Float[np.ndarray, "n 2"], known: Bool[np.ndarray, "n 2"]) -> tuple[Interval, ...]:
    """Intervals by their ends, and whether data identify these."""
    return tuple(Interval(float(a), float(b), bool(x), bool(y)) for (a, b), (x, y) in zip(ends, known, strict=True))


@dataclass(frozen=True, eq=False)
class Identifiability:
    """How well data identify parameters, by their information."""

    ranges: Ranges
    theta: Float[np.ndarray, "n"]
    root: Float[np.ndarray, "n n"]  # R of F = R^T R: as exact as the Jacobian is, which F is not
    share: float  # of a range: with a smaller standard error a parameter counts as identifiable

    @property
    def eigenvalues(self) -> Float[np.ndarray, "n"]:
        """Information of each direction, the largest first."""
        return self._decomposed[0] ** 2

    @property
    def directions(self) -> Float[np.ndarray, "n n"]:
        """Directions in the box of the ranges, one a row, the best identified one first."""
        return self._decomposed[1]

    @property
    def errors(self) -> Float[np.ndarray, "n"]:
        """Standard errors of the parameters, as shares of their ranges: 0.29 where the data identify nothing."""
        return np.sqrt(self.directions.T**2 @ (1 / (self.eigenvalues + RANGE)))

    @property
    def spreads(self) -> Float[np.ndarray, "n"]:
        """Standard errors by the data alone, as shares of the ranges."""
        return np.sqrt(self.directions.T**2 @ (1 / np.maximum(self.eigenvalues, _FLAT)))

    def widened(self, by: Float[np.ndarray, "n"]) -> "Identifiability":
        """The same with standard errors so many times as large, and correlated as they are."""
        return replace(self, root=self.root / by)

    @property
    def identifiable(self) -> Bool[np.ndarray, "n"]:
        """Which parameters are identifiable, each on its own."""
        return self.errors < self.share

    @property
    def rank(self) -> int:
        """How many directions are identifiable."""
        return int(np.sum(1 / np.sqrt(self.eigenvalues + RANGE) < self.share))

    @property
    def parameters(self) -> float:
        r"""Identifiable parameters, counted in parts: $\sum \lambda / (\lambda + 12)$, the trace of what data add."""
        return float(np.sum(self.eigenvalues / (self.eigenvalues + RANGE)))

    def intervals(self, coverage: float = 0.95) -> tuple[Interval, ...]:
        r"""Intervals by the data alone: normal on their scales with $F^{-1}$ (Laplace), cut at the bounds."""
        u, half = self.ranges.places(self.theta), ndtri(0.5 + coverage / 2) * self.spreads
        ends = self.ranges.values(np.clip([u - half, u + half], 0.0, 1.0))
        return intervals_of(ends.T, np.stack([u - half > 0, u + half < 1], axis=1))

    def words(self, intervals: Sequence[Interval] | None = None) -> list[str]:
        """A sentence for each parameter, or for those that are identifiable only in combination or are correlated.

        Intervals are those given, one for each parameter, else `intervals()`.
        """
        ends = self.intervals() if intervals is None else intervals
        value = [f"{x:.4g} (95 %: {one.text})" for x, one in zip(self.theta, ends, strict=True)]
        names = self.ranges.names
        out = [f"{names[k]}: identifiable, {value[k]}" for k in np.flatnonzero(self.identifiable)]
        out += self._correlated()
        for group in self._groups():
            called = self._called(group)
            combinations = self._combinations(group)
            if len(group) > _WRITTEN and combinations:
                out.append(f"{called}: only in combination, {len(combinations)} of {len(group)} combinations{_APART}")
            elif len(group) > 1 and combinations:
                out.append(f"{called}: only in combination, {', '.join(combinations)}{_APART}")
            elif self._changes_nothing(group):
                out.append(f"{called}: not identifiable{_UNMOVED}")
            else:
                out.append(f"{called}: hardly identifiable, {', '.join(value[k] for k in group)}{_MORE}")
        return out

    def words_without_errors(self) -> list[str]:
        """A sentence for each parameter on which nothing compared depends, which holds whatever the errors are."""
        groups = filter(self._changes_nothing, self._groups())
        return [f"{self._called(group)}: not identifiable{_UNMOVED}" for group in groups]

    def to_dataset(self) -> "xr.Dataset":
        """All of it: over `parameter`, and over `direction`, the best identified one first."""
        import xarray as xr

        return xr.Dataset(
            {
                "value": ("parameter", self.theta),
                "error": ("parameter", self.errors, {"long_name": "standard error, as a share of the range"}),
                "identifiable": ("parameter", self.identifiable),
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
    def _unknown(self) -> Float[np.ndarray, "n n"]:
        """Projection onto what is not identifiable; the same however directions of equal information are chosen."""
        rest = self.directions[self.rank :]
        return rest.T @ rest

    def _changes_nothing(self, group: Sequence[int]) -> bool:
        return all(self.errors[k] > _NOTHING / np.sqrt(RANGE) for k in group)

    def _called(self, group: Sequence[int]) -> str:
        names = [self.ranges.names[k] for k in group]
        return " and ".join(filter(None, [", ".join(names[:-1]), names[-1]]))

    def _groups(self) -> list[list[int]]:
        """Parameters that are not identifiable, grouped by what couples them."""
        left, groups = [int(k) for k in np.flatnonzero(~self.identifiable)], []
        while left:
            group, left = [left[0]], left[1:]
            for k in group:  # grows while it is gone through
                joined = [i for i in left if abs(self._unknown[k, i]) > _COUPLED]
                group += joined
                left = [i for i in left if i not in joined]
            groups.append(sorted(group))
        return groups

    @property
    def correlations(self) -> Float[np.ndarray, "n n"]:
        """Correlations of the errors of the parameters, by the data alone."""
        J = self.directions.T / np.sqrt(np.maximum(self.eigenvalues, _FLAT))
        size = np.linalg.norm(J, axis=1)
        return (J @ J.T) / np.outer(size, size)

    def _correlated(self) -> list[str]:
        """Pairs of identifiable parameters whose errors are nearly one, by the data alone."""
        share, told, names = self.correlations, self.identifiable, self.ranges.names
        pairs = [(i, k) for k in range(len(names)) for i in range(k) if told[i] and told[k]]
        return [
            f"{names[i]} and {names[k]}: correlated ({share[i, k]:+.3f}), the error of one comes with that of the other"
            for i, k in pairs
            if abs(share[i, k]) > _CORRELATED
        ]

    def _combinations(self, group: list[int]) -> list[str]:
        """Identifiable combinations of a group: products of powers of parameters on logarithmic scales, else sums."""
        size, weights = np.linalg.eigh(np.eye(len(group)) - self._unknown[np.ix_(group, group)])
        width = (self.ranges.ends[:, 1] - self.ranges.ends[:, 0])[group]
        names, log = [self.ranges.names[k] for k in group], self.ranges.log[group]
        out = []
        for weight in (weights / width[:, None]).T[size > 0.5]:
            weight = weight / weight[np.argmax(np.abs(weight * width))]
            kept = [k for k in range(len(group)) if abs(weight[k] * width[k]) > _SMALL * np.abs(weight * width).max()]
            if log.all():
                terms = [f"{names[k]}^{weight[k]:.2g}".removesuffix("^1") for k in kept]
            else:
                terms = [f"{weight[k]:+.2g} {f'ln {names[k]}' if log[k] else names[k]}" for k in kept]
            out.append(" ".join(terms))
        return out


def identifiability(misfit: Misfit, theta: Float[np.ndarray, "n"], share: float = 0.1) -> Identifiability:
    """How well data identify parameters near theta; with a standard error below `share` of its range one counts as so.

    Raises InputError for a share that is not between 0 and 0.28, for parameters outside of their ranges, and where
    residuals are NaN or infinite.
    """
    if not 0 < share <= 0.28:
        raise InputError(f"is {share:g}; it must lie between 0 and 0.28, what a range alone leaves.", field="share")
    return Identifiability(misfit.ranges, np.asarray(theta, dtype=float), _root(misfit, theta), share)


class Helpful(NamedTuple):
    """What another measurement would add."""

    name: str
    gain: float  # how many parameters more are identifiable, in parts
    identifiable: tuple[str, ...]  # parameters that are so then, and were not before
    after: Identifiability  # with it

    @property
    def text(self) -> str:
        """The gain in words."""
        more = f"; then identifiable: {', '.join(self.identifiable)}" if self.identifiable else ""
        directions = f"{self.after.rank} of {len(self.after.theta)} directions"
        return f"{self.name}: {self.gain:+.2f} parameters, {directions}{more}"


def most_helpful(known: Identifiability, candidates: Mapping[str, Misfit]) -> list[Helpful]:
    r"""Measurements that could be made next, each alone added to what is known, the most helpful first.

    The gain is that of $\sum \lambda / (\lambda + 12)$ (`parameters`): what is known well already counts little.
    Residuals of a candidate are those of its expected standard errors; only their derivatives matter. Raises
    InputError for a candidate with other parameters or ranges.
    """
    out = []
    for name, misfit in candidates.items():
        same = misfit.ranges.names == known.ranges.names and np.array_equal(misfit.ranges.ends, known.ranges.ends)
        if not same:
            raise InputError("has other parameters or ranges than what is known.", field=name)
        root = np.linalg.qr(np.concatenate([known.root, _root(misfit, known.theta)])).R
        after = Identifiability(known.ranges, known.theta, root, known.share)
        more = tuple(known.ranges.names[k] for k in np.flatnonzero(after.identifiable & ~known.identifiable))
        out.append(Helpful(name, after.parameters - known.parameters, more, after))
    return sorted(out, key=lambda one: -one.gain)


def _root(misfit: Misfit, theta: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n n"]:
    """R of the information R^T R of a misfit's data."""
    n = len(theta)
    return np.linalg.qr(np.concatenate([misfit.derivatives(misfit.places(theta)), np.zeros((n, n))])).R

r"""Standard errors of columns: those that are given, others from the residuals, and what they make of intervals.

Of n residuals of a column and p parameters, N residuals in all:

$$ \sigma^2 = \frac{N}{N - p} \frac{1}{n} \sum r^2 $$

Where all rows are shapes at rest they are few: columns of one dimension then share one standard error, and intervals
are those of Student's t with $n (1 - p/N)$ degrees of freedom. Residuals that are no more than the parameters say
nothing of an error: it is asked for.
"""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float
from scipy.special import stdtrit

from nectosome.units import InputError, count, read_positive, show_quantity

from ..fits.errors import SIDES
from ..fits.misfit import robust_error
from .trials import Compared, RobotTrial

if TYPE_CHECKING:
    import xarray as xr

_EXACT = 1e-6  # of a column's range: stands for the standard error where the model has made the data


class StandardErrors:
    """Standard errors of the columns of some trials, with so many parameters."""

    def __init__(
        self,
        trials: Sequence[RobotTrial],
        compared: Sequence[Compared],
        given: Mapping[str, float],
        parameters: Sequence[str],
        robust: bool = False,  # standard errors of all but outliers
    ):
        """Raise InputError for fewer readings than parameters, and for a column that reads 0 in all rows."""
        counts = np.sum([np.isfinite(trial.measured).sum(axis=1) for trial in trials], axis=0)
        self._count, self._parameters, self._robust = int(counts.sum()), len(parameters), robust
        if self._count < self._parameters:
            raise InputError(
                f"{count(self._count, 'reading')} cannot identify {len(parameters)} unknown quantities "
                f"({', '.join(parameters)}). Compare more rows or columns, or vary fewer.",
                field="vary",
            )
        self.given = np.array([given.get(one.column, np.nan) for one in compared])  # NaN of others
        self.sizes = np.array([_size(trials, c, one.column) for c, one in enumerate(compared)])
        self._few = all(trial.rows is not None for trial in trials)
        keys = np.array([one.reading.dimension if self._few else one.column for one in compared])
        groups = (np.isnan(self.given) & (keys == key) for key in dict.fromkeys(keys.tolist()))
        self._groups = [group for group in groups if group.any()]
        self._counts = [int(counts[group].sum()) for group in self._groups]
        few = [group for group, n in zip(self._groups, self._counts, strict=True) if n <= self._parameters]
        self.asked = tuple(one.column for c, one in enumerate(compared) if any(group[c] for group in few))

    @property
    def follow(self) -> bool:
        """Whether some follow from the residuals, so that these are about as large as they say."""
        return bool(self._groups) and not self.asked

    @property
    def first(self) -> Float[np.ndarray, "k"]:
        """Those to begin with: given ones, else how much a column varies."""
        return np.where(np.isnan(self.given), self.sizes, self.given)

    def of(self, residuals: Sequence[Float[np.ndarray, "k n"]]) -> Float[np.ndarray, "k"]:
        """Standard errors by the residuals of all trials; those to begin with where one is asked for."""
        if self.asked:
            return self.first
        each = [np.concatenate(rows) for rows in zip(*residuals, strict=True)]
        free = self._count / max(self._count - self._parameters, 1)
        found = self.given.copy()
        for group in self._groups:
            left = np.concatenate([each[c] for c in np.flatnonzero(group)])
            error = robust_error(left) if self._robust else np.sqrt(np.nanmean(left**2))
            found[group] = np.maximum(np.sqrt(free) * error, _EXACT * self.sizes[group])
        return found

    @property
    def wider(self) -> Float[np.ndarray, "k"]:
        """By how much an interval is wider than a normal one, as standard errors are estimates."""
        out = np.ones(self.given.size)
        if self._few and not self.asked:
            for group, n in zip(self._groups, self._counts, strict=True):
                out[group] = stdtrit(n * (1 - self._parameters / self._count), 0.975) / SIDES
        return out

    def question(self) -> list[str]:
        """A sentence that asks for what is needed for an interval."""
        if not self.asked:
            return []
        columns = ", ".join(self.asked)
        what = f"{count(self._count, 'reading')} and {self._parameters} unknown cannot tell the error of {columns}"
        return [f"no intervals: {what}. Give it (--error {self.asked[0]}=..., or error: in its columns), or more rows"]


def given_error(column: str, size: str | float, compared: Sequence[Compared]) -> float:
    """Return the standard error of a column that was given, in SI or as text. Raises InputError."""
    one = next((one for one in compared if one.column == column), None)
    if one is None:
        raise InputError(f"{column} is not compared.", field="error")
    if isinstance(size, str):
        return read_positive(size, one.reading.dimension, f"error of {column}")
    if not size > 0:
        raise InputError(f"of {column} is {size:g}; it must be more than 0.", field="error")
    return float(size)


def stated_errors(recordings: "Sequence[xr.Dataset]", compared: Sequence[Compared]) -> dict[str, float]:
    """Standard errors of columns that recordings say themselves [SI]. Raises InputError where they contradict."""
    found = dict[str, float]()
    for one in compared:
        said = {
            float(x[one.column].attrs["error"])
            for x in recordings
            if "error" in getattr(x.get(one.column), "attrs", {})
        }
        if len(said) > 1:
            low, high = (show_quantity(x, one.reading.dimension) for x in (min(said), max(said)))
            raise InputError(
                f"has an error of {low} in one recording and of {high} in another. Give one, with --error.",
                field=one.column,
            )
        if said:
            found[one.column] = said.pop()
    return found


def _size(trials: Sequence[RobotTrial], c: int, column: str) -> float:
    """How much a column varies [SI]: in a motion about its mean, over shapes at rest about theirs, or from 0."""
    rows = (trial.measured[c] for trial in trials if trial.rows is None)
    moving = [row - np.nanmean(row) for row in rows if np.isfinite(row).any()]
    still = [trial.measured[c] for trial in trials if trial.rows is not None]
    if still:
        rows = np.concatenate(still)
        varies = np.nanmax(rows) > np.nanmin(rows)
        moving.append(rows - np.nanmean(rows) if varies else rows)
    size = float(np.sqrt(np.nanmean(np.concatenate(moving) ** 2)))
    if size == 0:
        raise InputError("reads 0 in all rows: nothing can be identified from it.", field=column)
    return size

"""A simulator made to agree with a few experiments: a parameter is estimated, then residuals are corrected."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError, did_you_mean

from .gaussian_process import Surface
from .grids import GridTable
from .observe import Experiments
from .residuals import (
    Correction,
    Given,
    ParameterField,
    Simulated,
    affine,
    field_of,
    gaussian,
    nothing,
    rigid,
    rigid_raw,
    thin_plate,
)

_BLOCK = 1000  # conditions at once: memory goes with them


class Method(NamedTuple):
    """How a simulator is corrected."""

    parameter: bool  # whether its parameter is estimated first
    residual: Callable[[Given], Correction]  # how residuals are then corrected


_RESIDUALS = {"svd": rigid, "svd-raw": rigid_raw, "affine": affine, "thin-plate": thin_plate, "gp": gaussian}
METHODS = {"cn": Method(True, nothing)} | {
    f"{first}{name}": Method(bool(first), residual) for name, residual in _RESIDUALS.items() for first in ("", "cn-")
}


@dataclass(frozen=True)
class Corrected:
    """A simulator that was corrected."""

    table: GridTable
    field: ParameterField | None  # of the parameter, where it was estimated
    correction: Correction

    def simulated(self, conditions: Float[np.ndarray, "n d"]) -> Simulated:
        """The simulator with its parameter as estimated."""
        x, none = self.table.in_box(conditions), np.zeros(len(conditions))
        if self.field is None:
            return Simulated(conditions, x, self.table.simulated(conditions)[0], Surface(none, none), none)
        field = self.field.at(x)
        parameter, steep = self.field.parameter(field.mean)
        values, derivatives = self.table.simulated(conditions, parameter)
        return Simulated(conditions, x, values, field, derivatives * steep)

    def predict(self, conditions: Float[np.ndarray, "n d"]) -> Surface:
        """Corrected values, and their errors where the method gives them (NaN else). Raises InputError off the grid."""
        blocks = [conditions[k : k + _BLOCK] for k in range(0, max(len(conditions), 1), _BLOCK)]
        found = [self.correction(self.simulated(block)) for block in blocks]
        return Surface(*(np.concatenate(x) for x in zip(*found, strict=True)))

    def parameter(self, conditions: Float[np.ndarray, "n d"]) -> Surface:
        """The parameter and its error: the nominal one where none is estimated."""
        if self.field is None:
            return Surface(np.full(len(conditions), self.table.nominal), np.full(len(conditions), np.nan))
        field = self.field.at(self.table.in_box(conditions))
        parameter, steep = self.field.parameter(field.mean)
        return Surface(parameter, steep * field.error)


@dataclass(frozen=True)
class SimToReal:
    """How to correct a simulator; `fit` does it.

    "cn" estimates the table's parameter, whatever it is, from the experiments; "svd", "affine",
    "thin-plate" and "gp" correct the residuals. "cn-svd" is the method of Hu et al. 2024, "cn-svd-raw" as
    they print it; only "gp" and "cn-gp" give errors. Raises InputError for a method that there is not.
    """

    method: str = "cn-gp"

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(f'"{self.method}" is no method.{did_you_mean(self.method, METHODS)}', field="method")

    def fit(self, table: GridTable, experiments: Experiments) -> Corrected:
        """The corrected simulator; without experiments the simulator as it is. Raises InputError (`field_of`)."""
        if not len(experiments.values):
            return Corrected(table, None, nothing())
        estimated, residual = METHODS[self.method]
        field = field_of(table, experiments) if estimated else None
        there = Corrected(table, field, nothing()).simulated(experiments.conditions)
        return Corrected(table, field, residual(Given(there, experiments.values, experiments.errors, field)))


def leave_one_out(how: SimToReal, table: GridTable, experiments: Experiments) -> Surface:
    """Each experiment predicted by the others: the error of a prediction that can be known without more experiments.

    Raises InputError for fewer than two experiments, and where a parameter is estimated from one of them only.
    """
    m = len(experiments.values)
    if m < 2:
        raise InputError(f"{m} experiment; two are needed to leave one out.")
    rows, estimate = np.arange(m), experiments.estimate
    if estimate is not None and METHODS[how.method].parameter:
        known = np.flatnonzero(np.isfinite(estimate.errors) & table.holds(estimate.values))
        if known.size == 1:
            only = f"only experiment {known[0] + 1} determines it, and without that one none does"
            raise InputError(f"{only}. Measure more, or take a method that needs none, such as gp.", field=table.called)
    found = [how.fit(table, experiments.take(rows != k)).predict(experiments.conditions[[k]]) for k in rows]
    return Surface(*(np.concatenate(x) for x in zip(*found, strict=True)))

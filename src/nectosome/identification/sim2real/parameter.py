"""A parameter that a simulator does not know, over all conditions, from what experiments tell of it."""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .conditions import Experiments, ParameterEstimate
from .gaussian_process import Surface, gaussian_process
from .grids import GridTable

_DOUBT = 0.1  # of a parameter: how far off it may be told, usually


@dataclass(frozen=True)
class ParameterField:
    r"""A parameter over the conditions, as $u = \ln\frac{p - p_0}{p_1 - p} - \ln\frac{p_n - p_0}{p_1 - p_n}$.

    The table's ends $p_0$ and $p_1$ are never passed, and u is 0 where the parameter is the nominal $p_n$.
    """

    table: GridTable
    x: Float[np.ndarray, "m d"]  # conditions in the unit box, of experiments that tell something
    u: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # of u
    doubt: Float[np.ndarray, "m"]  # what a tenth of the parameter is of u
    apart: bool

    def at(self, x: Float[np.ndarray, "n d"]) -> Surface:
        """The field u at conditions in the unit box."""
        return gaussian_process(self.x, self.u, self.errors, x)

    def parameter(self, u: Float[np.ndarray, "n"]) -> tuple[Float[np.ndarray, "n"], Float[np.ndarray, "n"]]:
        """Parameter of a field, and its slope by u."""
        low, high = self.table.parameter[[0, -1]]
        share = 1 / (1 + np.exp(-u) * (high - self.table.nominal) / (self.table.nominal - low))
        return low + (high - low) * share, (high - low) * share * (1 - share)


def field_of(table: GridTable, experiments: Experiments) -> ParameterField:
    """Field of the table's parameter. Raises InputError where there is none, or where no experiment tells it."""
    if table.parameter.size == 1:
        raise InputError(
            "the simulated grid has no axis of a parameter. Simulate several values of one, or take a method that "
            "needs none, such as gp.",
            field="method",
        )
    told = experiments.told or matched(table, experiments)
    low, high = table.parameter[[0, -1]]
    known = np.isfinite(told.errors) & table.holds(told.values)
    if not known.any():
        raise InputError(
            f"no experiment tells it within the simulated grid, {low:g} to {high:g}. Simulate more values of it, or "
            "take a method that needs none, such as gp.",
            field=table.called,
        )
    p, n = told.values[known], table.nominal
    u = np.log((p - low) / (high - p)) - np.log((n - low) / (high - n))
    steep = (high - low) / ((p - low) * (high - p))
    x = table.in_box(experiments.conditions[known])
    return ParameterField(table, x, u, steep * told.errors[known], steep * _DOUBT * np.abs(p), told.apart)


def matched(table: GridTable, experiments: Experiments) -> ParameterEstimate:
    """What the values themselves tell: the parameter with which the simulator gives them."""
    return ParameterEstimate(
        *table.matching(experiments.conditions, experiments.values, experiments.errors), apart=False
    )

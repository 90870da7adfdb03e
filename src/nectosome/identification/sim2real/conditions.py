"""What was measured at some conditions, with standard errors, and what it tells of a simulator's parameter."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from jaxtyping import Bool, Float, Int

from nectosome.units import InputError


@dataclass(frozen=True)
class ParameterEstimate:
    """What experiments tell of a parameter: one number for each, NaN where one tells nothing."""

    values: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # standard errors
    apart: bool  # told by something else than the values that are corrected, such as peaks: it counts on its own


@dataclass(frozen=True)
class Experiments:
    """One row for each conditions at which something was measured."""

    conditions: Float[np.ndarray, "m d"]
    values: Float[np.ndarray, "m"]
    errors: Float[np.ndarray, "m"]  # standard errors of the values
    told: ParameterEstimate | None = None

    def __post_init__(self) -> None:
        """Raise InputError where a number is none, an error negative, or conditions stand there twice."""
        rows = np.column_stack([self.conditions, self.values, self.errors])
        wrong = np.flatnonzero(~np.isfinite(rows).all(axis=1) | (self.errors < 0))
        if wrong.size:
            raise InputError(f"experiment {wrong[0] + 1} has no number, or a negative standard error.")
        if len(np.unique(self.conditions, axis=0)) < len(self.conditions):
            raise InputError("two experiments have the same conditions. Average repeats first.")

    def take(self, rows: Int[np.ndarray, "k"] | Bool[np.ndarray, "m"]) -> Self:
        """Some of them."""
        told = self.told and ParameterEstimate(self.told.values[rows], self.told.errors[rows], self.told.apart)
        return type(self)(self.conditions[rows], self.values[rows], self.errors[rows], told)

"""What all tasks of a design share: variables with ranges, what is made as good as it gets, the file of a design."""

from abc import abstractmethod

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription
from nectosome.description.variables import Box, Variable
from nectosome.search import Evaluation, Task
from nectosome.units import InputError

_AT_AN_END = 1e-3  # of a variable's range, on its scale


class DesignTask(Task):
    """A task over quantities of a robot, or of what it is made to do."""

    description: RobotDescription
    variables: tuple[Variable, ...]
    objective_name: str  # of what is made as good as it gets, among the outputs of evaluations

    @property
    def names(self) -> tuple[str, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Names of the variables."""
        return tuple(v.name for v in self.variables)

    @property
    def levels(self) -> tuple[int, ...]:  # pyright: ignore[reportIncompatibleVariableOverride]
        """How many values each variable takes, 0 for one that takes all."""
        return tuple(v.levels for v in self.variables)

    @property
    def box(self) -> Box:
        """From the unit box to values and back."""
        return Box(self.variables)

    def values(self, u: Float[np.ndarray, "n"]) -> dict[str, float]:
        """Values of the variables at a design."""
        return dict(zip(self.names, self.box.values(u).tolist(), strict=True))

    def _check_variables(self) -> None:
        if not self.variables:
            raise InputError("there is nothing to choose: at least one variable is needed.", field="variables")

    @property
    @abstractmethod
    def units(self) -> dict[str, str]:
        """Units of the outputs that describe a design, the objective first."""

    @abstractmethod
    def chosen(self, u: Float[np.ndarray, "n"]) -> str:
        """Return the file that holds a design."""

    @property
    @abstractmethod
    def own(self) -> Float[np.ndarray, "n"]:
        """The robot's or mission's own numbers, as places in the ranges; outside of [0, 1] where they are outside."""

    def shown(self, evaluation: Evaluation) -> str:
        """Objective of a design, with its unit."""
        name = self.objective_name
        return f"{evaluation.outputs[name]:.4g} {self.units[name].removesuffix('1')}".strip()

    def at_an_end(self, u: Float[np.ndarray, "n"]) -> list[Variable]:
        """Variables of a design that stand at an end of their range: a wider one may make it better."""
        return [v for v, x in zip(self.variables, u, strict=True) if min(x, 1 - x) < _AT_AN_END]

"""Tasks whose variables are quantities with ranges: what files and command lines ask for."""

from abc import abstractmethod

import numpy as np
from jaxtyping import Float

from nectosome.io import RobotDescription
from nectosome.io.variables import Box, Variable

from .task import Task

_AT_AN_END = 1e-3  # of a variable's range, on its scale


class Varied(Task):
    """A task over quantities of a robot, or of what it is made to do."""

    description: RobotDescription
    variables: tuple[Variable, ...]
    objective: str  # name of what is made as good as it gets, among the outputs of evaluations

    @property
    def box(self) -> Box:
        """From the unit box to values and back."""
        return Box(self.variables)

    @property
    @abstractmethod
    def told(self) -> dict[str, str]:
        """Units of the outputs that are told of a design, the objective first."""

    @abstractmethod
    def chosen(self, u: Float[np.ndarray, "n"]) -> str:
        """Return the file that holds a design."""

    def at_an_end(self, u: Float[np.ndarray, "n"]) -> list[Variable]:
        """Variables of a design that stand at an end of their range: a wider one may make it better."""
        return [v for v, x in zip(self.variables, u, strict=True) if min(x, 1 - x) < _AT_AN_END]

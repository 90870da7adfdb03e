"""Genetic algorithm and differential evolution (package pymoo)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ..contract import Optimiser, Search
from ..task import Space
from .populations import first_population, pymoo, run_generations

_SETTLED = 1e-8  # of the box: differences as small move nothing
_WEIGHT, _CROSSOVER = 0.8, 0.9  # of differences, and the share of parameters taken over: Storn and Price 1997


@dataclass(frozen=True)
class Genetic(Optimiser):
    """Genetic algorithm with real numbers: simulated binary crossover and polynomial mutation (Deb 2001).

    A design that breaks constraints loses against one that breaks them less.
    """

    population: int = 100
    evaluations: int = 5000
    name: ClassVar[str] = "genetic"

    def __post_init__(self):
        self._at_least("population", 4)
        self._at_least("evaluations", 1)

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError where pymoo is not installed."""
        pymoo("core")

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Search the whole box; `start` is one of the first population."""
        ga = pymoo("algorithms.soo.nonconvex.ga")
        algorithm = ga.GA(self.population, **first_population(start, self.population, seed))
        return run_generations(algorithm, space, seed, self.evaluations)


@dataclass(frozen=True)
class Differential(Genetic):
    """Differential evolution, best/1/bin with weight 0.8 and crossover 0.9 (Storn and Price 1997; Price 2005).

    - population: ten times the number of variables unless given.
    """

    population: int | None = None  # pyright: ignore[reportIncompatibleVariableOverride]
    name: ClassVar[str] = "differential"

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Search the whole box; `start` is one of the first population."""
        size = self.population or 10 * space.variables
        de = pymoo("algorithms.soo.nonconvex.de")
        options = {"variant": "DE/best/1/bin", "F": _WEIGHT, "CR": _CROSSOVER}
        algorithm = de.DE(size, **options, **first_population(start, size, seed))
        return run_generations(algorithm, space, seed, self.evaluations, _SETTLED)

"""Genetic algorithm with real numbers: simulated binary crossover and polynomial mutation (package pymoo)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ..contract import Optimiser, Search
from ..task import Space
from .populations import first_population, pymoo, run_generations


@dataclass(frozen=True)
class Genetic(Optimiser):
    """Genetic algorithm (Deb 2001); a design that breaks constraints loses against one that breaks them less."""

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

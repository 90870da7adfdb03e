"""The front between several objectives: NSGA-II (package pymoo), then polishing with exact derivatives."""

from collections.abc import Generator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ..contract import Ask, Optimiser, Outcome, Search
from ..dominance import front, goals, limits
from ..task import Evaluation, Space
from .gradient import Gradient
from .populations import first_population, pymoo, run_generations


@dataclass(frozen=True)
class Nsga2(Optimiser):
    """Designs where no objective gets better but at another's expense (Deb 2002); `front` picks them.

    - versus: a constraint, from 0, whose limit is let go: its value is an objective too. Needed where the task has a
      single objective.
    - population: with a start, this and drawn designs are the first one.
    - polish: of at most so many designs, evenly spread over the front, the objective is minimised by `Gradient` with
      `versus` held where it is; 0 for none.
    """

    versus: int | None = None
    population: int = 100
    polish: int = 0
    evaluations: int = 5000
    name: ClassVar[str] = "nsga2"

    def __post_init__(self):
        message = f"is {self.versus}; constraints are counted from 0."
        self._require("versus", self.versus is None or self.versus >= 0, message)
        self._at_least("population", 4)
        self._at_least("polish", 0)
        self._require("polish", self.versus is not None or not self.polish, "needs versus.")
        self._at_least("evaluations", 1)

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError for a single objective, a constraint that there is not, and where pymoo is missing."""
        pymoo("core")
        if self.versus is None:
            self._require("versus", space.objectives > 1, "is needed: the task has one objective.")
        else:
            message = f"is {self.versus}; the task has {space.constraints} constraints, counted from 0."
            self._require("versus", self.versus < space.constraints, message)

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Spread designs over the front."""
        nsga2 = pymoo("algorithms.moo.nsga2")
        algorithm = nsga2.NSGA2(self.population, **first_population(start, self.population, seed))
        both = (lambda e: goals(e, self.versus)), (lambda e: limits(e, self.versus))
        spread = run_generations(algorithm, space, seed, self.evaluations, 0.0, *both)
        seen: list[Evaluation] = []
        outcome = yield from _seen(spread, seen)
        members = front(seen, self.versus)
        if not members:
            return Outcome(False, "no feasible design found", outcome.iterations)
        if not self.polish or self.versus is None:
            return Outcome(True, outcome.message, outcome.iterations)
        iterations = outcome.iterations
        chosen = sorted({round(i) for i in np.linspace(0, len(members) - 1, self.polish)})
        for member in [members[i] for i in chosen]:
            shift = member.constraints[self.versus] * np.eye(space.constraints)[self.versus]
            iterations = yield from _held(Gradient().search(space, member.u, seed), shift, iterations)
        return Outcome(True, f"{outcome.message}, {len(chosen)} designs polished", iterations)


def _seen(search: Search, seen: list[Evaluation]) -> Search:
    """Pass a search on, and keep its evaluations."""
    ask = next(search)
    while True:
        found = yield ask
        seen += found
        try:
            ask = search.send(found)
        except StopIteration as end:
            return end.value


def _held(search: Search, shift: Float[np.ndarray, "m"], iterations: int) -> Generator[Ask, list[Evaluation], int]:
    """Pass a search on that sees constraints less `shift`, after so many iterations; how many there are at its end."""
    ask = next(search)
    while True:
        found = yield replace(ask, iterations=iterations + ask.iterations)
        try:
            ask = search.send([replace(e, constraints=e.constraints - shift) for e in found])
        except StopIteration as end:
            return iterations + end.value.iterations

"""The front between several objectives: NSGA-II (package pymoo), then polishing with exact derivatives."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from ..contract import Outcome, Search
from ..history import front, goals, limits
from ..task import Evaluation, Space
from .genetic import PymooOptimiser
from .gradient import Gradient


@dataclass(frozen=True)
class Nsga2(PymooOptimiser):
    """Designs where no objective gets better but at another's expense (Deb 2002); `front` picks them.

    - versus: a constraint, from 0, whose limit is let go: its value is an objective too. Needed where the task has a
      single objective.
    - polish: of at most so many designs, evenly spread over the front, the objective is minimised by `Gradient` with
      `versus` held where it is; 0 for none.
    """

    versus: int | None = None
    population: int | None = 100
    polish: int = 0
    evaluations: int = 5000
    name: ClassVar[str] = "nsga2"

    def __post_init__(self):
        super().__post_init__()
        message = f"is {self.versus}; constraints are counted from 0."
        self._require("versus", self.versus is None or self.versus >= 0, message)
        self._at_least("polish", 0)
        self._require("polish", self.versus is not None or not self.polish, "needs versus.")

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError for a single objective, a constraint that there is not, and where pymoo is missing."""
        super().check(space, start)
        if self.versus is None:
            self._require("versus", space.objectives > 1, "is needed: the task has one objective.")
        else:
            message = f"is {self.versus}; the task has {space.constraints} constraints, counted from 0."
            self._require("versus", self.versus < space.constraints, message)

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Spread designs over the front."""
        both = (lambda e: goals(e, self.versus)), (lambda e: limits(e, self.versus))
        seen: list[Evaluation] = []
        spread = self.run_generations("moo.nsga2.NSGA2", space, start, seed, 0.0, *both)
        outcome = yield from _relay(spread, seen)
        members = front(seen, self.versus)
        if not members:
            return Outcome(False, "no feasible design found", outcome.iterations)
        if not self.polish or self.versus is None:
            return Outcome(True, outcome.message, outcome.iterations)
        iterations = outcome.iterations
        chosen = sorted({round(i) for i in np.linspace(0, len(members) - 1, self.polish)})
        for member in [members[i] for i in chosen]:
            shift = member.constraints[self.versus] * np.eye(space.constraints)[self.versus]
            polished = yield from _relay(Gradient().search(space, member.u, seed), seen, iterations, shift)
            iterations = polished.iterations
        return Outcome(True, f"{outcome.message}, {len(chosen)} designs polished", iterations)


def _relay(
    search: Search, seen: list[Evaluation], iterations: int = 0, shift: Float[np.ndarray, "m"] | float = 0.0
) -> Search:
    """Pass a search on after so many iterations, that sees constraints less `shift`; what it finds goes to `seen`."""
    ask = next(search)
    while True:
        evaluations = yield replace(ask, iterations=iterations + ask.iterations)
        seen += evaluations
        try:
            ask = search.send([replace(e, constraints=e.constraints - shift) for e in evaluations])
        except StopIteration as end:
            return replace(end.value, iterations=iterations + end.value.iterations)

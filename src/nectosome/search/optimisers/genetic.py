"""Optimisers of pymoo, a generation at a time: genetic algorithm, differential evolution, fronts by NSGA-II."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.io.extras import package

from ..contract import OBJECTIVE_TOLERANCE, Ask, Optimiser, Outcome, Search
from ..history import front, goals, limits
from ..task import Evaluation, Space
from .gradient import Gradient

_KEPT = 1e-6  # violation of a constraint that counts as kept
_USUAL = 60  # generations of a search
_SETTLED = 1e-8  # of the box: differences as small move nothing
_WEIGHT, _CROSSOVER = 0.8, 0.9  # of differences, and the share of parameters taken over: Storn and Price 1997


class PymooOptimiser(Optimiser):
    """An optimiser of pymoo, which searches the whole box.

    - population: ten times the number of variables where it is None. With a start, this and drawn designs are the
      first one.
    - objective_tolerance: it ends where the objectives of a population with all constraints kept have differed by less
      for `quiet` generations.
    """

    population: int | None
    quiet: ClassVar[int] = 3

    def __post_init__(self):
        super().__post_init__()
        self._at_least("population", 4)

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError where pymoo is not installed."""
        _pymoo("core")

    def likely(self, space: Space) -> int:
        """Some tens of generations."""
        return min(self.evaluations, _USUAL * (self.population or 10 * space.variables))

    def run_generations(
        self,
        algorithm: str,
        space: Space,
        start: Float[np.ndarray, "n"] | None,
        seed: int,
        settled: float = 0.0,
        objectives: Callable[[Evaluation], Float[np.ndarray, "k"]] = lambda e: e.objectives[:1],
        constraints: Callable[[Evaluation], Float[np.ndarray, "m"]] = lambda e: e.constraints,
        **options: Any,
    ) -> Search:
        """Run an algorithm by its module and class; until a population is as small as `settled`, a share of the box.

        What has no solution breaks its constraints by infinity: it loses every comparison.
        """
        n, size = space.variables, self.population or 10 * space.variables
        if start is not None:
            drawn = np.random.default_rng(seed).uniform(size=(size - 1, n))
            options["sampling"] = np.vstack([start, drawn])
        module, _, kind = algorithm.rpartition(".")
        running = getattr(_pymoo(f"algorithms.{module}"), kind)(size, **options)
        rest = Evaluation.unsolved(np.zeros(n), space.constraints, "none", space.objectives - 1)
        k, m = objectives(rest).size, constraints(rest).size
        problem = _pymoo("core.problem").Problem(n_var=n, n_obj=k, n_ieq_constr=m + 1, xl=np.zeros(n), xu=np.ones(n))
        running.setup(problem, termination=_pymoo("core.termination").NoTermination(), seed=seed)
        made = generations = quiet = 0
        while made < self.evaluations:
            candidates = running.ask()
            if candidates is None:
                return Outcome(True, "there are no new candidates", generations)
            evaluations = yield Ask(candidates.get("X"), iterations=generations)
            made, generations = made + len(evaluations), generations + 1
            candidates.set("F", np.array([objectives(e) if e.solved else np.zeros(k) for e in evaluations]))
            limits = [[*constraints(e), -1.0] if e.solved else np.full(m + 1, np.inf) for e in evaluations]
            candidates.set("G", np.array(limits))
            for one in candidates:
                one.evaluated.update(("F", "G", "H"))
            running.tell(infills=candidates)
            values, kept = running.pop.get("F"), (running.pop.get("G") <= _KEPT).all()
            quiet = quiet + 1 if kept and np.ptp(values) < self.objective_tolerance * np.abs(values).min() else 0
            if quiet >= self.quiet:
                return self._arrived(generations)
            if np.ptp(running.pop.get("X"), axis=0).max() < settled:
                return Outcome(True, "the population has settled", generations)
        return Outcome(False, f"{made} evaluations made", generations)


@dataclass(frozen=True)
class Genetic(PymooOptimiser):
    """Genetic algorithm with real numbers: simulated binary crossover and polynomial mutation (Deb 2001).

    A design that breaks constraints loses against one that breaks them less.
    """

    population: int | None = 100
    evaluations: int = 5000
    objective_tolerance: float = OBJECTIVE_TOLERANCE
    name: ClassVar[str] = "genetic"
    quiet: ClassVar[int] = 30  # as is usual with pymoo: mutations go on among members that are alike

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Run the algorithm."""
        return self.run_generations("soo.nonconvex.ga.GA", space, start, seed)


@dataclass(frozen=True)
class Differential(PymooOptimiser):
    """Differential evolution, best/1/bin with weight 0.8 and crossover 0.9 (Storn and Price 1997; Price 2005)."""

    population: int | None = None
    evaluations: int = 5000
    objective_tolerance: float = OBJECTIVE_TOLERANCE
    name: ClassVar[str] = "differential"

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Run the algorithm, until all candidates are alike."""
        options = {"variant": "DE/best/1/bin", "F": _WEIGHT, "CR": _CROSSOVER}
        return self.run_generations("soo.nonconvex.de.DE", space, start, seed, _SETTLED, **options)


def _pymoo(module: str) -> Any:
    return package(f"pymoo.{module}", "search")


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

    def likely(self, space: Space) -> int:
        """All that it may make: nothing says that a front has arrived."""
        return self.evaluations

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

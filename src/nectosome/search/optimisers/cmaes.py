"""Evolution strategy with covariance matrix adaptation, constraints by an augmented Lagrangian (package cma)."""

import math
import warnings
from collections.abc import Generator
from dataclasses import dataclass
from typing import Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float

from ..contract import OBJECTIVE_TOLERANCE, Ask, Optimiser, Outcome, Search
from ..task import Evaluation, Space

_REDRAWS = 10  # populations drawn before a generation without enough solutions is given up
_KEPT = 1e-6  # violation of a constraint that counts as kept
_BROKEN = 1e-3  # violation of a settled population that is no longer rounding


@dataclass(frozen=True)
class CmaEs(Optimiser):
    r"""CMA-ES (Hansen 2016) with an augmented Lagrangian (Atamna, Auger and Hansen 2017); for rough objectives.

    Restarts begin elsewhere (BIPOP, Hansen 2009). They alternate, so that both kinds get as many evaluations: larger
    populations, twice as many each time, see the coarse shape of the objective; small ones
    $\lambda_0 (\lambda / 2 \lambda_0)^{u^2}$ with steps $\sigma_0 10^{-2u'}$, u and u' drawn from 0..1, look closely.

    - spread: first standard deviation, as a share of the box.
    - population: of the first run, 4 + 3 ln n unless given.
    - tolerance: spread at which a run ends, as a share of the box.
    - objective_tolerance: a run ends where the bests of its last 10 + 30 n / population generations, each with all
      constraints kept, differ by less: `tolfunhist` of the package, as a share.
    - restarts: how many there are.
    - unsolved: a design without a solution is drawn again (`redrawn`), so that the strategy only sees designs that have
      one, or ranked behind all others (`last`).
    """

    spread: float = 0.2
    population: int | None = None
    tolerance: float = 1e-6
    objective_tolerance: float = OBJECTIVE_TOLERANCE
    restarts: int = 0
    unsolved: Literal["redrawn", "last"] = "redrawn"
    evaluations: int = 5000
    name: ClassVar[str] = "cmaes"

    def __post_init__(self):
        super().__post_init__()
        self._require("spread", 0 < self.spread <= 1, f"is {self.spread}; it must lie between 0 and 1.")
        self._at_least("population", 4)
        fits = 0 < self.tolerance < self.spread
        self._require("tolerance", fits, f"is {self.tolerance}; it must lie between 0 and spread.")
        self._at_least("restarts", 0)
        known = self.unsolved in ("redrawn", "last")
        self._require("unsolved", known, f'is "{self.unsolved}"; it must be "redrawn" or "last".')

    def likely(self, space: Space) -> int:
        """Generations grow with the number of variables."""
        size = self.population or 4 + int(3 * math.log(space.variables))
        return min(self.evaluations, size * (30 + 15 * space.variables) * (1 + self.restarts))

    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Minimise from `start`, or from a drawn design."""
        rng, n = np.random.default_rng(seed), space.variables
        first = self.population or 4 + int(3 * math.log(n))
        at = rng.uniform(size=n) if start is None else start
        size, spread, spent = first, self.spread, [0, 0]
        large, doublings = True, 0
        run = _Generations(self, space)
        settled, message = False, ""
        for _ in range(1 + self.restarts):
            before = run.evaluations
            run_settled, message = yield from run.go(_strategy(at, spread, self.tolerance, size, rng, space))
            settled |= run_settled
            if run.evaluations >= self.evaluations and not run_settled:
                return Outcome(False, message, run.generations)
            spent[large] += run.evaluations - before
            large, at = spent[True] <= spent[False] or doublings == 0, rng.uniform(size=n)
            if large:
                doublings += 1
                size, spread = first * 2**doublings, self.spread
            else:
                u, narrow = rng.uniform(size=2)
                size = int(first * (2 ** (doublings - 1)) ** (u * u))
                spread = max(self.spread * 10 ** (-2 * narrow), 10 * self.tolerance)
        if self.restarts and settled:
            message = f"the population has settled in each of {1 + self.restarts} runs"
        return Outcome(settled, message, run.generations)


@dataclass
class _Generations:
    """Runs of one search, one after another; counts of all of them together."""

    options: CmaEs
    space: Space
    evaluations: int = 0
    generations: int = 0
    multipliers: Any = None

    def go(self, strategy: Any) -> Generator[Ask, list[Evaluation], tuple[bool, str]]:
        """Run a strategy to its end; whether it settled where constraints are kept, and how it ended in words."""
        self.multipliers = _multipliers(self.space) if self.space.constraints else None
        last, empty = self.options.unsolved == "last", 0
        bests, window = list[float](), 10 + math.ceil(30 * self.space.variables / strategy.popsize)
        while self.evaluations < self.options.evaluations:
            drawn, made = yield from self._generation(strategy, _REDRAWS if not last else 1)
            solved = [e for e in made if e.solved]
            self.generations += 1
            if len(solved) < (1 if last else strategy.popsize):
                empty += 1
                if not last or empty == _REDRAWS:
                    return False, "hardly a design around here has a solution"
            else:
                empty = 0
                strategy.tell(drawn, _ranked(made, self._fitness(solved)))
                bests.append(min((e.objective for e in solved if e.feasible(_KEPT)), default=math.inf))
            if len(bests) >= window and self._settled(bests[-window:]):
                return True, self.options._arrived(0).message
            if reasons := strategy.stop():
                broken = min((e.violation for e in solved), default=0.0)
                if broken > _BROKEN:
                    return False, f"the population has settled where constraints are broken by {broken:.2g}"
                return True, f"the population has settled ({', '.join(reasons)})"
        return False, f"{self.evaluations} evaluations made"

    def _generation(
        self, strategy: Any, draws: int
    ) -> Generator[Ask, list[Evaluation], tuple[list[np.ndarray], list[Evaluation]]]:
        """Draw a population; with more than one draw, until all of it is solved."""
        drawn: list[np.ndarray] = []
        made: list[Evaluation] = []
        tries = 0
        while len(made) < strategy.popsize and tries < draws * strategy.popsize:
            places = strategy.ask(strategy.popsize - len(made))
            evaluations = yield Ask(np.clip(places, 0.0, 1.0), iterations=self.generations)
            tries += len(places)
            kept = [(z, e) for z, e in zip(places, evaluations, strict=True) if e.solved or draws == 1]
            drawn += [z for z, _ in kept]
            made += [e for _, e in kept]
        self.evaluations += tries
        return drawn, made

    def _settled(self, bests: list[float]) -> bool:
        return max(bests) - min(bests) < self.options.objective_tolerance * abs(min(bests))

    def _fitness(self, found: list[Evaluation]) -> list[float]:
        """Objective plus augmented Lagrangian, whose coefficients follow the generation's best."""
        al = self.multipliers
        if al is None:
            return [e.objective for e in found]
        if not al.is_initialized:
            al.set_coefficients([e.objective for e in found], [e.constraints.tolist() for e in found])
        fitness = [e.objective + float(sum(al(e.constraints.tolist()))) for e in found]
        best = found[int(np.argmin(fitness))]
        al.update(best.objective, best.constraints.tolist())
        return fitness


def _ranked(made: list[Evaluation], fitness: list[float]) -> list[float]:
    """Fitness of a population from that of its solved members: what has no solution comes behind the worst of them."""
    worst = max(fitness)
    beyond = worst + max(worst - min(fitness), abs(worst), 1.0)
    rest = iter(fitness)
    return [next(rest) if e.solved else beyond for e in made]


def _strategy(
    start: Float[np.ndarray, "n"], spread: float, tolerance: float, population: int, rng: Any, space: Space
) -> Any:
    """A `CMAEvolutionStrategy` in the unit box that draws from `rng`, leaves no files, and ends by its spread."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # cma's own, about options it is given on purpose
        from cma import CMAEvolutionStrategy  # pyright: ignore[reportMissingImports]

        options = {
            "bounds": [[0.0] * start.size, [1.0] * start.size],
            "randn": lambda *shape: rng.standard_normal(shape),  # cma's numbers are those of the whole process
            "seed": math.nan,
            "popsize": population,
            "tolx": tolerance,
            "tolfun": 0,
            "tolfunhist": 0,
            "verbose": -9,
        }
        if space.constraints:
            options["tolstagnation"] = 0  # the fitness moves with the multipliers
        if space.steps.any():
            options["minstd"] = (space.steps / 3).tolist()  # else it stays on one value
        if start.size == 1:
            options["maxstd"] = math.inf  # cma fails to keep to it in one dimension
        return CMAEvolutionStrategy(start, spread, options)


def _multipliers(space: Space) -> Any:
    from cma.constraints_handler import AugmentedLagrangian  # pyright: ignore[reportMissingImports]

    class Quiet(AugmentedLagrangian):
        def _init_(self) -> None:
            self.logging = 0  # else it makes a folder, and files in it, where the user stands
            super()._init_()

    return Quiet(space.variables)

"""Evolution strategy with covariance matrix adaptation, constraints by an augmented Lagrangian (package cma)."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.search.covariance import covariance_strategy

from .task import Evaluate, Evaluation, Outcome, Solver, require

_REDRAWS = 10  # populations drawn before a generation without enough solutions is given up
_BROKEN = 1e-3  # violation of a settled population that is no longer rounding


@dataclass(frozen=True)
class Evolution(Solver):
    """CMA-ES (Hansen 2016) with an augmented Lagrangian (Atamna, Auger and Hansen 2017); for rough objectives.

    A design without a solution is drawn again, so that the strategy only ever sees designs that have one.

    - spread: first standard deviation, as a share of the box.
    - population: designs a generation; 4 + 3 ln n unless given.
    - tolerance: spread at which it ends, as a share of the box.
    - evaluations: no generation is begun after so many.
    """

    spread: float = 0.2
    population: int | None = None
    tolerance: float = 1e-6
    evaluations: int = 5000

    def __post_init__(self):
        require(0 < self.spread <= 1, f"Evolution: spread is {self.spread}; it must lie between 0 and 1.")
        require(
            self.population is None or self.population >= 4,
            f"Evolution: population is {self.population}; at least 4 are needed.",
        )
        require(
            0 < self.tolerance < self.spread,
            f"Evolution: tolerance is {self.tolerance}; it must lie between 0 and spread.",
        )
        require(self.evaluations >= 1, f"Evolution: evaluations is {self.evaluations}; at least 1 is needed.")

    def solve(self, evaluate: Evaluate, start: Float[np.ndarray, "n"], seed: int) -> Outcome:
        """Minimise from `start`."""
        width, rng = evaluate.upper - evaluate.lower, np.random.default_rng(seed)
        strategy = covariance_strategy(
            (start - evaluate.lower) / width,
            self.spread,
            self.tolerance,
            self.population,
            rng,
            tolstagnation=0,  # the fitness moves with the multipliers
        )
        # cma warns when it is first imported, which is silenced above
        from cma.constraints_handler import AugmentedLagrangian  # pyright: ignore[reportMissingImports]

        class Quiet(AugmentedLagrangian):
            def _init_(self) -> None:
                self.logging = 0  # else it makes a folder, and files in it, where the user stands
                super()._init_()

        multipliers = Quiet(start.size) if evaluate.constraints else None
        asked = 0
        while asked < self.evaluations:
            drawn: list[np.ndarray] = []
            found: list[Evaluation] = []
            tries = 0
            while len(found) < strategy.popsize and tries < _REDRAWS * strategy.popsize:
                for z in strategy.ask(strategy.popsize - len(found)):
                    u = np.clip(evaluate.lower + np.clip(z, 0, 1) * width, evaluate.lower, evaluate.upper)
                    e = evaluate(u)
                    tries += 1
                    if e.solved:
                        drawn.append(z)
                        found.append(e)
            asked += tries
            evaluate.close_iteration()
            if len(found) < strategy.popsize:
                return Outcome(False, "hardly a design around here has a solution")
            strategy.tell(drawn, self._fitness(found, multipliers))
            if reasons := strategy.stop():
                broken = min(e.violation for e in found)
                if broken > _BROKEN:
                    return Outcome(False, f"the population has settled where constraints are broken by {broken:.2g}")
                return Outcome(True, f"the population has settled ({', '.join(reasons)})")
        return Outcome(False, f"{asked} evaluations made")

    @staticmethod
    def _fitness(found: list[Evaluation], multipliers: Any) -> list[float]:
        """Objective plus augmented Lagrangian, whose coefficients follow the generation's best."""
        if multipliers is None:
            return [e.objective for e in found]
        al = multipliers
        if not al.is_initialized:
            al.set_coefficients([e.objective for e in found], [e.constraints.tolist() for e in found])
        fitness = [e.objective + float(sum(al(e.constraints.tolist()))) for e in found]
        best = found[int(np.argmin(fitness))]
        al.update(best.objective, best.constraints.tolist())
        return fitness

"""The front between two objectives: NSGA-II (Deb 2002, package pymoo), then polishing with exact slopes."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.search.covariance import need, undominated

from .gradient import Gradient
from .task import Evaluate, Evaluation, Outcome, Solver, require


@dataclass(frozen=True)
class Front(Solver):
    """Designs where neither the objective nor the constraint number `versus` gets better but at the other's expense.

    The limit of that constraint is let go, and its value, slopes included, is the second objective. NSGA-II looks for
    the front, then its designs are polished: the objective is minimised with the second one held where it is. The
    front is read off the evaluations by `front`.

    - versus: which constraint, from 0.
    - population, generations: of NSGA-II; it draws its own first designs and adds the start.
    - polish: at most so many designs, evenly spread over the front; 0 for none.
    """

    versus: int
    population: int = 40
    generations: int = 50
    polish: int = 20

    def __post_init__(self):
        require(self.versus >= 0, f"Front: versus is {self.versus}; constraints are counted from 0.")
        require(self.population >= 4, f"Front: population is {self.population}; at least 4 are needed.")
        require(self.generations >= 1, f"Front: generations is {self.generations}; at least 1 is needed.")
        require(self.polish >= 0, f"Front: polish is {self.polish}; it must not be negative.")

    def solve(self, evaluate: Evaluate, start: Float[np.ndarray, "n"], seed: int) -> Outcome:
        """Spread designs over the front. Raises InputError where pymoo is not installed."""
        require(
            self.versus < evaluate.constraints,
            f"Front: versus is {self.versus}; the task has {evaluate.constraints} constraints, counted from 0.",
        )
        seen = _Seen(evaluate)
        self._spread(seen, start, seed)
        members = front(seen.evaluations, self.versus)
        if not members:
            return Outcome(False, "no feasible design found")
        if self.polish:
            chosen = sorted({round(i) for i in np.linspace(0, len(members) - 1, self.polish)})
            for member in [members[i] for i in chosen]:
                held = _Held(evaluate, self.versus, float(member.constraints[self.versus]))
                Gradient().solve(held, member.u, seed)
        return Outcome(True, f"{self.generations} generations, {min(self.polish, len(members))} designs polished")

    def _spread(self, evaluate: "_Seen", start: np.ndarray, seed: int) -> None:
        need("pymoo", "fronts")
        from pymoo.algorithms.moo.nsga2 import NSGA2  # pyright: ignore[reportMissingImports]
        from pymoo.core.problem import ElementwiseProblem  # pyright: ignore[reportMissingImports]
        from pymoo.optimize import minimize  # pyright: ignore[reportMissingImports]

        lower, upper, versus = evaluate.lower, evaluate.upper, self.versus
        others = [i for i in range(evaluate.constraints) if i != versus]

        class TwoObjectives(ElementwiseProblem):
            def _evaluate(self, x: np.ndarray, out: dict[str, Any], *args: Any, **kwargs: Any) -> None:
                del args, kwargs
                e = evaluate(x)
                # what has no solution loses every comparison, whatever it is compared with
                out["F"] = [e.objective, e.constraints[versus]] if e.solved else [np.inf, np.inf]
                out["G"] = [*e.constraints[others], 0.0] if e.solved else [np.inf] * (len(others) + 1)

        problem = TwoObjectives(n_var=lower.size, n_obj=2, n_ieq_constr=len(others) + 1, xl=lower, xu=upper)
        rng = np.random.default_rng(seed)
        first = np.vstack([start, rng.uniform(lower, upper, (self.population - 1, lower.size))])
        algorithm: Any = NSGA2(self.population, sampling=first)  # pyright: ignore[reportArgumentType]
        minimize(
            problem, algorithm, ("n_gen", self.generations), seed=seed, callback=lambda _: evaluate.close_iteration()
        )


def front(
    evaluations: list[Evaluation] | tuple[Evaluation, ...], versus: int, tolerance: float = 1e-6
) -> list[Evaluation]:
    """Return the evaluations that no other one dominates in (objective, constraint `versus`), by rising objective.

    Only those count that keep all other constraints.
    """
    fit = [e for e in evaluations if e.solved and np.delete(e.constraints, versus).max(initial=0.0) <= tolerance]
    costs = np.array([(e.objective, e.constraints[versus]) for e in fit]).reshape(-1, 2)
    return [fit[k] for k in undominated(costs)]


class _Seen:
    """An `Evaluate` that remembers what it was asked."""

    def __init__(self, evaluate: Evaluate):
        self.lower, self.upper, self.constraints = evaluate.lower, evaluate.upper, evaluate.constraints
        self.close_iteration = evaluate.close_iteration
        self.evaluations: list[Evaluation] = []
        self._evaluate = evaluate

    def __call__(self, u: np.ndarray, slopes: bool = False) -> Evaluation:
        e = self._evaluate(u, slopes)
        self.evaluations.append(e)
        return e


class _Held:
    """An `Evaluate` with the limit of one constraint moved to `level`."""

    def __init__(self, evaluate: Evaluate, versus: int, level: float):
        self.lower, self.upper, self.constraints = evaluate.lower, evaluate.upper, evaluate.constraints
        self.close_iteration = evaluate.close_iteration
        self._evaluate = evaluate
        self._shift = level * np.eye(evaluate.constraints)[versus]

    def __call__(self, u: np.ndarray, slopes: bool = False) -> Evaluation:
        e = self._evaluate(u, slopes)
        return replace(e, constraints=e.constraints - self._shift)

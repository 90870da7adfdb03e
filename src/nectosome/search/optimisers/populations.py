"""Optimisers of the package pymoo, a generation at a time."""

from collections.abc import Callable
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.extras import package

from ..contract import Ask, Outcome, Search
from ..task import Evaluation, Space

Numbers = Callable[[Evaluation], Float[np.ndarray, "k"]]


def pymoo(module: str) -> Any:
    """A module of pymoo. Raises InputError where it is not installed."""
    return package(f"pymoo.{module}", "pymoo")


def first_population(start: Float[np.ndarray, "n"] | None, population: int, seed: int) -> dict[str, Any]:
    """Options with which the first population holds `start`; none without one."""
    if start is None:
        return {}
    drawn = np.random.default_rng(seed).uniform(size=(population - 1, start.size))
    return {"sampling": np.vstack([start, drawn])}


def run_generations(
    algorithm: Any,
    space: Space,
    seed: int,
    evaluations: int,
    settled: float = 0.0,
    objectives: Numbers = lambda e: e.objectives[:1],
    constraints: Numbers = lambda e: e.constraints,
) -> Search:
    """Run an algorithm of pymoo until so many evaluations, or a population as small as `settled`, a share of the box.

    What has no solution breaks its constraints by infinity: it loses every comparison.
    """
    rest = Evaluation.unsolved(np.zeros(space.variables), space.constraints, "none", space.objectives - 1)
    k, m, n = objectives(rest).size, constraints(rest).size, space.variables
    problem = pymoo("core.problem").Problem(n_var=n, n_obj=k, n_ieq_constr=m + 1, xl=np.zeros(n), xu=np.ones(n))
    algorithm.setup(problem, termination=pymoo("core.termination").NoTermination(), seed=seed)
    asked = generations = 0
    while asked < evaluations:
        candidates = algorithm.ask()
        if candidates is None:
            return Outcome(True, "there are no new candidates", generations)
        found = yield Ask(candidates.get("X"), iterations=generations)
        asked, generations = asked + len(found), generations + 1
        candidates.set("F", np.array([objectives(e) if e.solved else np.zeros(k) for e in found]))
        limits = [[*constraints(e), -1.0] if e.solved else np.full(m + 1, np.inf) for e in found]
        candidates.set("G", np.array(limits))
        for one in candidates:
            one.evaluated.update(("F", "G", "H"))
        algorithm.tell(infills=candidates)
        if np.ptp(algorithm.pop.get("X"), axis=0).max() < settled:
            return Outcome(True, "the population has settled", generations)
    return Outcome(False, f"{asked} evaluations made", generations)

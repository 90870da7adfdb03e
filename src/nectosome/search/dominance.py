"""Fronts between several objectives: what no other design equals or beats in all of them."""

from collections.abc import Sequence

import numpy as np
from jaxtyping import Float, Int

from .task import Evaluation


def front(evaluations: Sequence[Evaluation], versus: int | None = None, tolerance: float = 1e-6) -> list[Evaluation]:
    """Return the feasible evaluations that no other one dominates in their objectives, by rising first objective.

    With `versus` the limit of that constraint is let go, and its value is an objective too.
    """
    kept = [e for e in evaluations if e.solved and limits(e, versus).max(initial=0.0) <= tolerance]
    if not kept:
        return []
    return [kept[k] for k in undominated(np.array([goals(e, versus) for e in kept]))]


def goals(evaluation: Evaluation, versus: int | None) -> Float[np.ndarray, "k"]:
    """Objectives of an evaluation, the value of constraint `versus` behind them."""
    let_go = evaluation.constraints[:0] if versus is None else evaluation.constraints[[versus]]
    return np.concatenate([evaluation.objectives, let_go])


def limits(evaluation: Evaluation, versus: int | None) -> Float[np.ndarray, "m"]:
    """Constraints of an evaluation but for `versus`."""
    return evaluation.constraints if versus is None else np.delete(evaluation.constraints, versus)


def undominated(values: Float[np.ndarray, "m k"]) -> Int[np.ndarray, "f"]:
    """Indices of the rows of k costs that no other row equals or beats in all, by rising first cost; of equals one."""
    kept: list[int] = []
    front = np.empty_like(values)
    for k in np.lexsort(values.T[::-1]):  # what beats a row comes before it
        if not (front[: len(kept)] <= values[k]).all(axis=1).any():
            front[len(kept)] = values[k]
            kept.append(int(k))
    return np.array(kept, dtype=int)

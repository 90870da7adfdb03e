"""What one start found, and many; and the front between several objectives."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from jaxtyping import Float, Int

from .task import Evaluation

if TYPE_CHECKING:
    import xarray

_SAME = 1e-6  # of the spread of all objectives: what differs by less is as good


@dataclass(frozen=True, eq=False)
class Start:
    """One start: its evaluations, and what is read off them.

    The first `draws` evaluations are those of drawn designs; the last of them is where the optimiser began, unless
    `begun` is false because none was accepted.
    """

    number: int
    evaluations: tuple[Evaluation, ...]
    marks: tuple[int, ...]  # how many evaluations were made at the end of each iteration
    converged: bool
    message: str  # how the optimiser ended, or why it did not begin
    tolerance: float
    draws: int = 0
    begun: bool = True
    rejected: Mapping[str, int] = field(default_factory=dict)  # drawn designs refused, by reason
    note: str = ""  # on its record
    cancelled: bool = False

    @cached_property
    def best(self) -> Evaluation | None:
        """The feasible evaluation with the lowest objective, None where there is none."""
        return self.best_of(len(self.evaluations))

    def best_at(self, iteration: int) -> Evaluation | None:
        """Return the best after so many iterations of the optimiser; 0 is the start, too many the end."""
        if iteration >= len(self.marks):
            return self.best
        return self.best_of(self.draws if iteration == 0 else self.marks[iteration - 1])

    def best_of(self, evaluations: int) -> Evaluation | None:
        """Return the best of the first evaluations; designs that were drawn and refused do not count."""
        first = max(self.draws - 1, 0) if self.begun else self.draws
        feasible = [e for e in self.evaluations[first:evaluations] if e.feasible(self.tolerance)]
        return min(feasible, key=lambda e: e.objective, default=None)

    @property
    def value(self) -> float:
        """The lowest objective of a feasible design; inf where there is none."""
        return np.inf if self.best is None else self.best.objective

    @property
    def values(self) -> Float[np.ndarray, "e"]:
        """Objective of every evaluation; inf where a design is not feasible."""
        return np.array([e.objective if e.feasible(self.tolerance) else np.inf for e in self.evaluations])

    def close(self, to: float) -> list[Evaluation]:
        """Return the feasible evaluations with an objective of at most `to`, best first: as good as the best."""
        values = self.values
        order = np.argsort(values, kind="stable")
        return [self.evaluations[k] for k in order[values[order] <= to]]

    def summed(self) -> "Start":
        """Return this start with the sum of all objectives as the only one."""
        summed = (replace(e, objective=float(e.objectives.sum()), others=e.others[:0]) for e in self.evaluations)
        return replace(self, evaluations=tuple(summed))

    @property
    def start(self) -> Float[np.ndarray, "n"] | None:
        """The design where the optimiser began, None where none was accepted or given."""
        return self.evaluations[self.draws - 1].u if self.begun and self.draws else None

    @property
    def seconds(self) -> float:
        """Time its evaluations took, those of an earlier run included [s]."""
        return sum(e.seconds for e in self.evaluations)


@dataclass(frozen=True, eq=False)
class Result:
    """The starts that are done, by number; not all of them where `cancelled`."""

    starts: tuple[Start, ...]
    names: tuple[str, ...]
    constraint_names: tuple[str, ...]
    cancelled: bool = False

    @property
    def evaluations(self) -> int:
        """How many there are in all."""
        return sum(len(start.evaluations) for start in self.starts)

    def best(self, count: int = 1, apart: float = 1e-2) -> tuple[Start, ...]:
        """Return the starts with the best results, best first, at most `count`.

        Results that differ by less than `apart`, in every variable of the unit box count as one.
        """
        chosen: list[tuple[Start, Evaluation]] = []
        for start, e in sorted(self._found(), key=lambda found: found[1].objective):
            if len(chosen) < count and all(np.abs(e.u - o.u).max() >= apart for _, o in chosen):
                chosen.append((start, e))
        return tuple(start for start, _ in chosen)

    def share(self, within: float = 0.01) -> float:
        """Return the share of the starts, 0 to 1, whose best is at most `within` of the best objective above it.

        Where the best objective is about 0, a millionth of the spread of all evaluated objectives counts instead.
        """
        objectives = [e.objective for _, e in self._found()]
        if not objectives:
            return 0.0
        best, solved = min(objectives), [e.objective for s in self.starts for e in s.evaluations if e.solved]
        above = max(within * abs(best), _SAME * float(np.ptp(solved)))
        return sum(f <= best + above for f in objectives) / len(self.starts)

    def to_dataset(self) -> "xarray.Dataset":
        """Return all evaluations, start after start, and a summary of each start, with the task's names.

        Dimensions: `evaluation`, `variable`, `constraint`, `output`, `start`. `best` counts evaluations from 0, -1
        where there is none; `iteration` is 0 for drawn designs.
        """
        import xarray

        pairs = [(start, i, e) for start in self.starts for i, e in enumerate(start.evaluations)]
        every = [e for _, _, e in pairs]
        outputs = sorted({name for e in every for name in e.outputs})
        k, n, m = len(every), len(self.names), len(self.constraint_names)
        values = [[e.outputs.get(name, np.nan) for name in outputs] for e in every]
        offsets = np.concatenate([[0], np.cumsum([len(start.evaluations) for start in self.starts])])
        best = [
            -1 if start.best is None else offset + start.evaluations.index(start.best)
            for start, offset in zip(self.starts, offsets, strict=False)
        ]
        by_evaluation = {
            "u": (("evaluation", "variable"), np.array([e.u for e in every]).reshape(k, n)),
            "objective": ("evaluation", np.array([e.objective for e in every])),
            "others": (("evaluation", "further"), np.array([e.others for e in every]).reshape(k, -1)),
            "constraints": (("evaluation", "constraint"), np.array([e.constraints for e in every]).reshape(k, m)),
            "outputs": (("evaluation", "output"), np.array(values, dtype=float).reshape(k, len(outputs))),
            "reason": ("evaluation", np.array([e.reason for e in every], dtype=str)),
            "seconds": ("evaluation", np.array([e.seconds for e in every])),
            "iteration": ("evaluation", np.array([_iteration(start, i) for start, i, _ in pairs], dtype=int)),
        }
        by_start = {
            "best": ("start", np.array(best, dtype=int)),
            "converged": ("start", np.array([start.converged for start in self.starts], dtype=bool)),
            "message": ("start", np.array([start.message for start in self.starts], dtype=str)),
            "draws": ("start", np.array([start.draws for start in self.starts], dtype=int)),
        }
        coordinates = {
            "variable": np.array(self.names, dtype=str),
            "constraint": np.array(self.constraint_names, dtype=str),
            "output": np.array(outputs, dtype=str),
            "start": np.array([start.number for start in self.starts], dtype=int),
            "evaluation_start": ("evaluation", np.array([start.number for start, _, _ in pairs], dtype=int)),
        }
        return xarray.Dataset(by_evaluation | by_start, coordinates)

    def _found(self) -> list[tuple[Start, Evaluation]]:
        return [(start, start.best) for start in self.starts if start.best is not None]


def _iteration(start: Start, index: int) -> int:
    """The iteration that evaluation `index` of a start belongs to, from 1; 0 for drawn designs."""
    return 0 if index < start.draws else int(np.searchsorted(start.marks, index, side="right")) + 1


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
    lower = np.empty_like(values)
    for k in np.lexsort(values.T[::-1]):  # what beats a row comes before it
        if not (lower[: len(kept)] <= values[k]).all(axis=1).any():
            lower[len(kept)] = values[k]
            kept.append(int(k))
    return np.array(kept, dtype=int)

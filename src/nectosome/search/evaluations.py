"""Evaluations as they are made: recorded at once, and handed back instead of computed when a search is repeated."""

import math
import time
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.journal import Journal
from nectosome.units import InputError

from .contract import Outcome, Search
from .executors.processes import count
from .task import Evaluate, Evaluation, Space, Task


class StoppedError(Exception):
    """The search was ended from outside of the optimiser; `outcome` says how."""

    def __init__(self, outcome: Outcome | None = None):
        super().__init__()
        self.outcome = outcome or Outcome(False, "cancelled")


class Recorder:
    """Evaluates for one start: all its evaluations in order, each in the journal before the optimiser sees it.

    Designs are evaluated one by one, and none twice; or a batch at once, where the task can do that. What is computed
    together is one record of the journal.

    - before(): called before anything new is computed; it may raise StoppedError.
    - after(new): called when evaluations are recorded or repeated; it may raise too.
    """

    def __init__(
        self,
        task: Task,
        evaluate: Evaluate | None = None,
        journal: Journal | None = None,
        before: Callable[[], None] = lambda: None,
        after: Callable[[bool], None] = lambda new: None,
    ):
        self.evaluations: list[Evaluation] = []
        self.marks: list[int] = []  # how many evaluations were made at the end of each iteration
        self.lowest = np.inf  # objective of a feasible design
        self._space, self._tolerance, self._journal = task.space, task.tolerance, journal
        self._batch = task.prepare_batch()
        self._evaluate = None if self._batch else evaluate or task.prepare()
        self._before, self._after = before, after
        self._recorded = list(journal.records) if journal else []
        self._made = 0  # records
        self._known: dict[bytes, Evaluation] = {}

    def __call__(self, points: Float[np.ndarray, "m n"], derivatives: bool = False) -> list[Evaluation]:
        """Return the evaluations of designs. Raises InputError where the record holds another design in its place."""
        points = self._space.nearest(np.array(points, dtype=float))
        points.setflags(write=False)
        return self._record(points, derivatives) if self._batch else [self._one(u, derivatives) for u in points]

    def drive(self, search: Search) -> Outcome:
        """Answer an optimiser until it ends."""
        with closing(search):
            answer: Any = None
            while True:
                try:
                    ask = search.send(answer)
                except StopIteration as end:
                    self._close_iterations(end.value.iterations)
                    return end.value
                self._close_iterations(ask.iterations)
                answer = self(ask.points, ask.derivatives)

    def _close_iterations(self, number: int) -> None:
        self.marks += [len(self.evaluations)] * (number - len(self.marks))

    def _one(self, u: np.ndarray, derivatives: bool) -> Evaluation:
        known = self._known.get(u.tobytes())
        if known is not None and (known.gradient is not None or not derivatives or not known.solved):
            return known
        (evaluation,) = self._record(u[None], derivatives)
        self._known[u.tobytes()] = evaluation
        return evaluation

    def _record(self, points: np.ndarray, derivatives: bool) -> list[Evaluation]:
        new = self._made >= len(self._recorded)
        evaluations = self._new(points, derivatives) if new else self._repeat(points, derivatives)
        self._made += 1
        self.evaluations += evaluations
        self.lowest = min([self.lowest, *(e.objective for e in evaluations if e.feasible(self._tolerance))])
        self._after(new)
        return evaluations

    def _repeat(self, points: np.ndarray, derivatives: bool) -> list[Evaluation]:
        record = self._recorded[self._made]
        known = decode(record) if "evaluations" in record else []
        if [e.u.tobytes() for e in known] != [u.tobytes() for u in points] or record["derivatives"] != derivatives:
            raise InputError(
                f"evaluation {len(self.evaluations) + 1} is not the one that the optimiser asks for now: it was "
                "recorded with other versions of nectosome or its optimisers. Start anew, in another folder.",
                file=str(self._journal.path) if self._journal else None,
            )
        return known

    def _new(self, points: np.ndarray, derivatives: bool) -> list[Evaluation]:
        self._before()
        begin = time.perf_counter()
        if self._batch is None:
            assert self._evaluate is not None
            evaluations = [self._evaluate(u, derivatives, self._memory_near(u)) for u in points]
        else:
            evaluations = self._batch(points)
        count(len(points))
        seconds = (time.perf_counter() - begin) / len(points)
        pairs = zip(evaluations, points, strict=True)
        sound = [replace(_sound(e, u, derivatives, self._space), seconds=seconds) for e, u in pairs]
        if self._journal:
            self._journal.append(encode(sound, derivatives))
        return sound

    def _memory_near(self, u: np.ndarray) -> Float[np.ndarray, "k"] | None:
        known = [e for e in self.evaluations if e.memory is not None]
        near = min(known, key=lambda e: float(np.abs(e.u - u).max()), default=None)
        return None if near is None else near.memory


def _sound(e: Evaluation, u: np.ndarray, derivatives: bool, space: Space) -> Evaluation:
    """The evaluation at `u`, unsolved where a number is not finite. Raises ValueError where the contract is broken."""
    others = space.objectives - 1
    if e.constraints.shape != (space.constraints,):
        raise ValueError(f"evaluate gives {e.constraints.size} constraints; the task names {space.constraints}.")
    if e.solved and e.others.shape != (others,):
        raise ValueError(f"evaluate gives {1 + e.others.size} objectives; the task has {space.objectives}.")
    if e.solved and derivatives and (e.gradient is None or e.jacobian is None):
        raise ValueError("evaluate gives no derivatives where the optimiser needs them.")
    numbers: dict[str, Any] = {"objective is": e.objectives, "constraints are": e.constraints}
    if derivatives:
        numbers |= {"derivatives are": e.gradient, "derivatives of the constraints are": e.jacobian}
    odd = [name for name, number in numbers.items() if not np.all(np.isfinite(number))] if e.solved else []
    if odd or not e.solved:
        reason = e.reason or f"the {odd[0]} not finite"
        return replace(Evaluation.unsolved(u, space.constraints, reason, others), outputs=e.outputs)
    return replace(e, u=u) if derivatives else replace(e, u=u, gradient=None, jacobian=None)


def encode(evaluations: list[Evaluation], derivatives: bool) -> dict[str, Any]:
    """Return evaluations that were computed together as JSON data; numbers that are not finite become text."""
    return {"derivatives": derivatives, "evaluations": [_encode(e) for e in evaluations]}


def decode(record: dict[str, Any]) -> list[Evaluation]:
    """Return the evaluations that `encode` made a record of."""
    return [_decode(one) for one in record["evaluations"]]


def _encode(e: Evaluation) -> dict[str, Any]:
    arrays = {"gradient": e.gradient, "jacobian": e.jacobian, "memory": e.memory}
    return {
        "u": e.u.tolist(),
        "objectives": [_plain(f) for f in e.objectives],
        "constraints": [_plain(g) for g in e.constraints],
        "reason": e.reason,
        "outputs": {name: _plain(value) for name, value in e.outputs.items()},
        "seconds": e.seconds,
        **{name: array.tolist() for name, array in arrays.items() if array is not None},
    }


def _decode(one: dict[str, Any]) -> Evaluation:
    u = np.array(one["u"], dtype=float)
    u.setflags(write=False)
    objectives = [float(f) for f in one["objectives"]]
    arrays = {name: np.array(one[name], dtype=float) for name in ("gradient", "memory") if name in one}
    if "jacobian" in one:
        arrays["jacobian"] = np.array(one["jacobian"], dtype=float).reshape(-1, u.size)
    return Evaluation(
        u=u,
        objective=objectives[0],
        others=np.array(objectives[1:]),
        constraints=np.array([float(g) for g in one["constraints"]]),
        reason=one["reason"],
        outputs={name: float(value) for name, value in one["outputs"].items()},
        seconds=one["seconds"],
        **arrays,
    )


def _plain(number: float) -> float | str:
    number = float(number)
    return number if math.isfinite(number) else str(number)

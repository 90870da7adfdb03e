"""Evaluations as they are made: recorded at once, and handed back instead of computed when a run is repeated."""

import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.journal import Journal
from nectosome.units import InputError

from .processes import count_one
from .task import Evaluation, Task

Compute = Callable[[Float[np.ndarray, "n"], bool, Float[np.ndarray, "k"] | None], Evaluation]


class StoppedError(Exception):
    """The run was cancelled."""


class Recorder:
    """The `Evaluate` of one start: all its evaluations in order, each in the journal before the solver sees it.

    A design that was evaluated before, with all that is asked for, is not evaluated again. `stop` is asked before each
    new evaluation; StoppedError is raised where it says yes.
    """

    def __init__(
        self,
        task: Task,
        compute: Compute,
        journal: Journal | None,
        stop: Callable[[], bool],
    ):
        self.lower, self.upper, self.constraints = task.lower, task.upper, len(task.constraint_names)
        self.evaluations: list[Evaluation] = []
        self.marks: list[int] = []
        self._compute, self._journal, self._stop = compute, journal, stop
        self._recorded = list(journal.records) if journal else []
        self._known: dict[bytes, Evaluation] = {}

    def __call__(self, u: Float[np.ndarray, "n"], slopes: bool = False) -> Evaluation:
        """Return the evaluation at `u`. Raises InputError where the record holds another design in its place."""
        u = np.array(u, dtype=float)
        u.setflags(write=False)
        known = self._known.get(u.tobytes())
        if known is not None and (known.slope is not None or not slopes or not known.solved):
            return known
        n = len(self.evaluations)
        evaluation = self._repeat(u, slopes, self._recorded[n]) if n < len(self._recorded) else self._new(u, slopes)
        self.evaluations.append(evaluation)
        self._known[u.tobytes()] = evaluation
        return evaluation

    def close_iteration(self) -> None:
        """Note that the evaluations so far make a whole number of iterations."""
        self.marks.append(len(self.evaluations))

    def _repeat(self, u: np.ndarray, slopes: bool, record: dict[str, Any]) -> Evaluation:
        evaluation = decode(record)
        if evaluation.u.tobytes() != u.tobytes() or record["slopes"] != slopes:
            raise InputError(
                f"evaluation {len(self.evaluations) + 1} is not the one that the solver asks for now: it was recorded "
                "with other versions of nectosome or its solvers. Start anew, in another folder.",
                file=str(self._journal.path) if self._journal else None,
            )
        return evaluation

    def _new(self, u: np.ndarray, slopes: bool) -> Evaluation:
        if self._stop():
            raise StoppedError
        count_one()
        begin = time.perf_counter()
        known = [e for e in self.evaluations if e.memory is not None]
        near = min(known, key=lambda e: float(np.abs((e.u - u) / (self.upper - self.lower)).max()), default=None)
        found = self._compute(u, slopes, None if near is None else near.memory)
        evaluation = replace(_sound(found, u, slopes, self.constraints), seconds=time.perf_counter() - begin)
        if self._journal:
            self._journal.append(encode(evaluation) | {"slopes": slopes})
        return evaluation


def _sound(e: Evaluation, u: np.ndarray, slopes: bool, constraints: int) -> Evaluation:
    """The evaluation at `u`, unsolved where a number is not finite. Raises ValueError where the contract is broken."""
    if e.constraints.shape != (constraints,):
        raise ValueError(f"evaluate gives {e.constraints.size} constraints; the task names {constraints}.")
    if e.solved and slopes and (e.slope is None or e.constraint_slopes is None):
        raise ValueError("evaluate gives no slopes where they were asked for.")
    if not e.solved:
        return replace(Evaluation.unsolved(u, constraints, e.reason), outputs=e.outputs)
    numbers = {"objective": e.objective, "constraints": e.constraints}
    if slopes:
        numbers |= {"slopes": e.slope, "constraint slopes": e.constraint_slopes}
    for name, number in numbers.items():
        if not np.all(np.isfinite(number)):
            verb = "is" if name == "objective" else "are"
            return replace(Evaluation.unsolved(u, constraints, f"the {name} {verb} not finite"), outputs=e.outputs)
    return replace(e, u=u) if slopes else replace(e, u=u, slope=None, constraint_slopes=None)


def encode(evaluation: Evaluation) -> dict[str, Any]:
    """Return an evaluation as JSON data; numbers that are not finite become text."""
    e = evaluation
    return {
        "u": e.u.tolist(),
        "objective": _plain(e.objective),
        "constraints": [_plain(g) for g in e.constraints],
        "slope": None if e.slope is None else e.slope.tolist(),
        "constraint_slopes": None if e.constraint_slopes is None else e.constraint_slopes.tolist(),
        "reason": e.reason,
        "outputs": {name: _plain(value) for name, value in e.outputs.items()},
        "memory": None if e.memory is None else e.memory.tolist(),
        "seconds": e.seconds,
    }


def decode(record: dict[str, Any]) -> Evaluation:
    """Return the evaluation that `encode` made a record of."""
    u = np.array(record["u"], dtype=float)
    u.setflags(write=False)
    slope, slopes, memory = record["slope"], record["constraint_slopes"], record["memory"]
    return Evaluation(
        u=u,
        objective=float(record["objective"]),
        constraints=np.array([float(g) for g in record["constraints"]]),
        slope=None if slope is None else np.array(slope, dtype=float),
        constraint_slopes=None if slopes is None else np.array(slopes, dtype=float).reshape(-1, u.size),
        reason=record["reason"],
        outputs={name: float(value) for name, value in record["outputs"].items()},
        memory=None if memory is None else np.array(memory, dtype=float),
        seconds=record["seconds"],
    )


def _plain(number: float) -> float | str:
    number = float(number)
    return number if math.isfinite(number) else str(number)

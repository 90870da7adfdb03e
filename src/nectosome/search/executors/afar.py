"""Starts that run in threads of this process and ask an executor for each evaluation, as workers of a cluster make it.

So journals are written here, and a worker needs nothing but the task.
"""

import threading
from collections.abc import Callable
from concurrent.futures import Executor, ThreadPoolExecutor, wait
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from ..evaluations import StoppedError
from ..task import Evaluate, EvaluateBatch, Evaluation, Task
from .spread import result, submit

_T = TypeVar("_T")
_AT_ONCE = 256  # starts, where an executor does not say how many it computes
_PULSE = 0.5  # s between looks whether to stop

_prepared_key: tuple[type, str] | None = None
_prepared_evaluate: Evaluate | None = None
_preparing = threading.Lock()


def prepared(task: Task, key: str) -> Evaluate:
    """The task's `evaluate`, made once in a process for as long as it works on the task of this key."""
    global _prepared_key, _prepared_evaluate
    with _preparing:
        if _prepared_evaluate is None or _prepared_key != (type(task), key):
            _prepared_key, _prepared_evaluate = (type(task), key), task.prepare()
        return _prepared_evaluate


class TaskAfar(Task):
    """A task whose evaluations an executor makes, until `stop` is set: then they raise StoppedError.

    - computed: how many were made.
    """

    def __init__(self, task: Task, executor: Executor):
        self.names, self.constraint_names, self.objectives = task.names, task.constraint_names, task.objectives
        self.levels = task.levels
        self.tolerance = task.tolerance  # pyright: ignore[reportAttributeAccessIssue]  a constant of other tasks
        self.stop, self.computed = threading.Event(), 0
        self._task, self._key, self._executor = task, task.key(), executor
        self._counting = threading.Lock()

    def key(self) -> str:
        """Text of the task."""
        return self._key

    def prepare(self) -> Evaluate:
        """Return what asks for an evaluation and waits for it."""

        def evaluate(u: np.ndarray, derivatives: bool, memory: np.ndarray | None) -> Evaluation:
            return self._ask(1, _evaluated, self._task, self._key, u, derivatives, memory)

        return evaluate

    def prepare_batch(self) -> EvaluateBatch | None:
        """Return what asks for a batch and waits for it; None where designs are evaluated one by one."""
        if self._task.prepare_batch() is None:
            return None
        return lambda points: self._ask(len(points), _evaluated_together, self._task, points)

    def accepts(self, evaluation: Evaluation) -> str:
        """Return why a drawn start is refused."""
        return self._task.accepts(evaluation)

    def _ask(self, evaluations: int, f: Callable[..., _T], *args: Any) -> _T:
        future = submit(self._executor, f, *args)
        while not wait([future], _PULSE).done:
            if self.stop.is_set() and future.cancel():
                raise StoppedError
        evaluated = result(future)
        with self._counting:
            self.computed += evaluations
        return evaluated


class Drivers:
    """Threads in which starts run, as many as the executor computes at once."""

    def __init__(self, task: Task, executor: Executor, starts: int):
        self.task = TaskAfar(task, executor)
        at_once = getattr(executor, "_max_workers", _AT_ONCE)  # no public name tells it
        self.pool, self.stop = ThreadPoolExecutor(min(starts, at_once)), self.task.stop

    def __enter__(self) -> "Drivers":
        return self

    def __exit__(self, *_: object) -> None:
        self.pool.shutdown()

    @property
    def computed(self) -> int:
        """Evaluations made so far."""
        return self.task.computed

    def tell_compiling(self) -> None:
        """Say nothing: who compiles afar is not known here."""


def _evaluated(
    task: Task, key: str, u: Float[np.ndarray, "n"], derivatives: bool, memory: np.ndarray | None
) -> Evaluation:
    return prepared(task, key)(u, derivatives, memory)


def _evaluated_together(task: Task, points: Float[np.ndarray, "m n"]) -> list[Evaluation]:
    evaluate = task.prepare_batch()
    assert evaluate is not None
    return evaluate(points)

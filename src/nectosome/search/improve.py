"""The best design that a solver finds from one start, in this process."""

from collections.abc import Callable

import numpy as np
from jaxtyping import Float

from .evaluations import Recorder
from .task import Evaluation, Solver, Task


def improve(
    task: Task, u: Float[np.ndarray, "n"], solver: Solver, progress: Callable[[int], None] | None = None
) -> Evaluation | None:
    """Best evaluation that keeps all limits on the way from u; None where there is none.

    `progress(evaluations)` is called before each new one.
    """

    def stop() -> bool:
        if progress is not None:
            progress(len(recorder.evaluations))
        return False

    recorder = Recorder(task, task.prepare(), None, stop)
    solver.solve(recorder, u, 1)
    kept = (e for e in recorder.evaluations if e.feasible(task.tolerance))
    return min(kept, key=lambda e: e.objective, default=None)

"""One search in this process, whose journal makes it go on after it was killed."""

from collections.abc import Callable
from contextlib import nullcontext
from pathlib import Path

import numpy as np
from jaxtyping import Float

from nectosome.io.journal import Journal
from nectosome.units import InputError

from .contract import Optimiser, Outcome
from .evaluations import Recorder, StoppedError
from .history import Start
from .search_folder import SearchFolder
from .task import Task


def minimise(
    task: Task,
    optimiser: Optimiser,
    start: Float[np.ndarray, "n"] | None = None,
    seed: int = 1,
    *,
    target: float | None = None,
    folder: str | Path | None = None,
    progress: Callable[[int, float], bool | None] | None = None,
) -> Start:
    """Minimise from one start, or from anywhere for optimisers that need none; all that was evaluated.

    - start: in the unit box.
    - target: it ends with an objective as low of a design that keeps all constraints.
    - folder: every evaluation is written there before the optimiser sees it. The same call with the same folder goes on
      where it ended, however it ended; it may ask for more evaluations or another target.
    - progress(evaluations, lowest objective so far): called when something new was computed; False cancels.

    Raises InputError for a folder that cannot be used, an optimiser that cannot search this task, a missing package.
    """
    if target is not None and task.objectives > 1:
        raise InputError("is of one objective; there are several. Leave it out.", field="target")
    optimiser.check_task(task, start is not None)

    def watch(new: bool) -> None:
        if target is not None and recorder.lowest <= target:
            raise StoppedError(Outcome(True, f"the target of {target:g} is reached"))
        if new and progress is not None and progress(len(recorder.evaluations), recorder.lowest) is False:
            raise StoppedError

    with (
        nullcontext() if folder is None else SearchFolder(folder, task, optimiser, seed) as held,
        nullcontext() if held is None else Journal(*held.journal(0)) as journal,
    ):
        recorder = Recorder(task, journal=journal, after=watch)
        try:
            outcome = recorder.drive(optimiser.search(task.space, start, seed))
        except StoppedError as end:
            outcome = end.outcome
    return Start(
        number=0,
        evaluations=tuple(recorder.evaluations),
        marks=tuple(recorder.marks),
        converged=outcome.converged,
        message=outcome.message,
        tolerance=task.tolerance,
        note=journal.damage if journal else "",
        cancelled=outcome.message == "cancelled",
    )

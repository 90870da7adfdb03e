"""The contract of optimisers, ask and tell: an optimiser asks for designs and is sent their evaluations.

Nobody but the recorder evaluates. It puts each evaluation into the journal before the optimiser sees it, and hands back
what a journal holds instead of computing it. So an optimiser knows nothing of journals, resuming, workers, targets or
cancelling, and a search that was killed goes on when it is run again.
"""

import threading
from abc import ABC, abstractmethod
from collections.abc import Callable, Generator
from dataclasses import asdict, dataclass
from queue import SimpleQueue
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .task import Evaluation, Space, Task

OBJECTIVE_TOLERANCE = 1e-5  # share of the objective


@dataclass(frozen=True, eq=False)
class Ask:
    """Designs to evaluate, in this order."""

    points: Float[np.ndarray, "m n"]  # in the unit box
    derivatives: bool = False
    iterations: int = 0  # of the optimiser that are complete


@dataclass(frozen=True)
class Outcome:
    """How an optimiser ended; what it found is read off its evaluations."""

    converged: bool
    message: str
    iterations: int = 0


Search = Generator[Ask, list[Evaluation], Outcome]


class Optimiser(ABC):
    """A way to minimise; a frozen dataclass with its options as fields.

    - name: as files and command lines call it.
    - derivatives: whether it asks for derivatives everywhere.
    - needs_start: whether it searches from a design only.
    - evaluations: no iteration is begun after so many.
    - objective_tolerance: a search has arrived where its objective changes by less than this share of it, as with
      `ftol_rel` of NLopt; each optimiser says among which designs. 0 for never.
    """

    name: ClassVar[str]
    derivatives: ClassVar[bool] = False
    needs_start: ClassVar[bool] = False
    evaluations: int
    objective_tolerance: float = 0.0

    def __post_init__(self) -> None:
        """Check the options; one with more of them checks these too."""
        self._at_least("evaluations", 1)
        share = self.objective_tolerance
        self._require("objective_tolerance", 0 <= share < 1, f"is {share}; it must lie between 0 and 1.")

    @abstractmethod
    def likely(self, space: Space) -> int:
        """Return how many evaluations a search usually takes, at most as many as it may; for the time left."""

    @abstractmethod
    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Yield each `Ask`, be sent its evaluations in the same order, and return the outcome.

        The same space, start, seed and evaluations make it ask for the same designs, whatever else draws random
        numbers. A design without a solution is never given a number that is better than one with a solution.

        - start: where to begin, in the unit box; None for an optimiser that looks everywhere.
        - seed: from 0 to 2^31 - 1.
        """

    def check(self, space: Space, start: bool) -> None:
        """Raise InputError where such a space cannot be searched with, or without, a start, or a package is missing."""
        self._require("start", start or not self.needs_start, "is missing: it searches from a design.")

    def check_task(self, task: Task, start: bool) -> None:
        """Likewise of a task, and where that has no derivatives and this needs them."""
        self.check(task.space, start)
        if self.derivatives:
            task.check_derivatives()

    def describe(self) -> dict[str, Any]:
        """Return name and options as JSON data, of which `make_optimiser` makes it again."""
        return {"name": self.name, **asdict(self)}  # pyright: ignore[reportArgumentType]

    def _arrived(self, iterations: int) -> Outcome:
        """The outcome of a search whose objective changes no more."""
        words = f"the objective changes by less than {self.objective_tolerance:g} of itself"
        return Outcome(True, words, iterations)

    def _require(self, option: str, fits: bool, message: str) -> None:
        """Raise InputError for an option that does not fit; for `__post_init__`."""
        if not fits:
            raise InputError(message, field=f"{type(self).__name__}: {option}")

    def _at_least(self, option: str, least: int) -> None:
        number = getattr(self, option)
        self._require(option, number is None or number >= least, f"is {number}; it must be at least {least}.")


class AbandonedError(Exception):
    """Nobody answers any more: the search was given up."""


def from_callback(solve: Callable[[Callable[[Ask], list[Evaluation]]], Outcome]) -> Search:
    """Search with solve(evaluate), which runs in a thread of its own and waits in `evaluate` for its answers.

    Once the search is closed `evaluate` raises AbandonedError, and `solve` must end.
    """
    asks: SimpleQueue[Any] = SimpleQueue()
    answers: SimpleQueue[list[Evaluation]] = SimpleQueue()
    abandoned = threading.Event()

    def evaluate(ask: Ask) -> list[Evaluation]:
        if not abandoned.is_set():
            asks.put(ask)
            answer = answers.get()
            if not abandoned.is_set():
                return answer
        raise AbandonedError

    def work() -> None:
        try:
            asks.put(solve(evaluate))
        except BaseException as error:
            asks.put(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    try:
        while isinstance(ask := asks.get(), Ask):
            answers.put((yield ask))
    finally:
        abandoned.set()
        answers.put([])
        thread.join()
    if isinstance(ask, BaseException):
        raise ask
    return ask

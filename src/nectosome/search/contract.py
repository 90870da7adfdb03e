"""The contract of optimisers, ask and tell: an optimiser asks for designs and is sent their evaluations.

Nobody but the recorder evaluates. It puts each evaluation into the journal before the optimiser sees it, and hands back
what a journal holds instead of computing it. So an optimiser knows nothing of journals, resuming, workers, targets or
cancelling, and a search that was killed goes on when it is run again.
"""

from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import asdict, dataclass
from typing import Any, ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError

from .task import Evaluation, Space


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
    - evaluations: no iteration is begun after so many.
    """

    name: ClassVar[str]
    derivatives: ClassVar[bool] = False
    evaluations: int

    @abstractmethod
    def search(self, space: Space, start: Float[np.ndarray, "n"] | None, seed: int) -> Search:
        """Yield each `Ask`, be sent its evaluations in the same order, and return the outcome.

        The same space, start, seed and evaluations make it ask for the same designs, whatever else draws random
        numbers. A design without a solution is never given a number that is better than one with a solution.

        - start: where to begin, in the unit box; None for an optimiser that looks everywhere.
        - seed: from 0 to 2^31 - 1.
        """

    def check(self, space: Space, start: bool) -> None:  # noqa: B027
        """Raise InputError where such a space cannot be searched with, or without, a start, or a package is missing."""

    def describe(self) -> dict[str, Any]:
        """Return name and options as JSON data, of which `make_optimiser` makes it again."""
        return {"name": self.name, **asdict(self)}  # pyright: ignore[reportArgumentType]

    def _require(self, option: str, fits: bool, message: str) -> None:
        """Raise InputError for an option that does not fit; for `__post_init__`."""
        if not fits:
            raise InputError(message, field=f"{type(self).__name__}: {option}")

    def _at_least(self, option: str, least: int) -> None:
        number = getattr(self, option)
        self._require(option, number is None or number >= least, f"is {number}; it must be at least {least}.")

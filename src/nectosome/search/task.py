"""What is to be designed: variables in a box, an objective, constraints; and what one evaluation of them tells."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar, Protocol, runtime_checkable

import numpy as np
from jaxtyping import Float


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Objective and constraints at one design, or why there are none.

    An evaluation whose `reason` is not empty found no solution: objective and constraints are nan, and no solver may
    put a number in their place.
    """

    u: Float[np.ndarray, "n"]  # the design, in the task's variables
    objective: float
    constraints: Float[np.ndarray, "m"]  # <= 0 where kept, in units of their limits
    slope: Float[np.ndarray, "n"] | None = None  # of the objective
    constraint_slopes: Float[np.ndarray, "m n"] | None = None
    reason: str = ""
    outputs: Mapping[str, float] = field(default_factory=dict)  # what else is worth remembering, by name
    memory: Float[np.ndarray, "k"] | None = None  # what helps to evaluate a design nearby
    seconds: float = 0.0  # it took, filled in by who records it

    @classmethod
    def unsolved(cls, u: Float[np.ndarray, "n"], constraints: int, reason: str) -> "Evaluation":
        """Return the evaluation of a design that has no solution, for a reason in words."""
        if not reason:
            raise ValueError("Evaluation: an unsolved design needs a reason.")
        return cls(u, np.nan, np.full(constraints, np.nan), reason=reason)

    @property
    def solved(self) -> bool:
        """Whether there is a solution."""
        return not self.reason

    @property
    def violation(self) -> float:
        """By how much the worst constraint is broken: 0 where all are kept, inf without a solution."""
        return float(max(0.0, self.constraints.max(initial=0.0))) if self.solved else np.inf

    def feasible(self, tolerance: float) -> bool:
        """Return whether there is a solution that breaks no constraint by more than `tolerance`."""
        return self.violation <= tolerance


class Task(ABC):
    """Minimise an objective over a box, with constraints g(u) <= 0. It is pickled and sent to worker processes.

    - names: of the variables [n]; constraint_names: of the constraints [m].
    - lower, upper: the box, the unit box unless told otherwise.
    - tolerance: the violation up to which a design counts as feasible.
    """

    names: tuple[str, ...]
    constraint_names: tuple[str, ...] = ()
    tolerance: ClassVar[float] = 1e-6

    @property
    def lower(self) -> Float[np.ndarray, "n"]:
        """Lower ends of the variables."""
        return np.zeros(len(self.names))

    @property
    def upper(self) -> Float[np.ndarray, "n"]:
        """Upper ends of the variables."""
        return np.ones(len(self.names))

    @abstractmethod
    def key(self) -> str:
        """Return a text that is the same for the same task only, today and tomorrow."""

    @abstractmethod
    def prepare(self) -> Callable[[Float[np.ndarray, "n"], bool, Float[np.ndarray, "k"] | None], Evaluation]:
        """Return evaluate(u, slopes, memory); called once in each worker, where programs are compiled.

        `memory` is that of the nearest design that this start has solved, None at first. For the same arguments
        `evaluate` always gives the same numbers; with `slopes` a solved evaluation has them.
        """

    def accepts(self, evaluation: Evaluation) -> str:
        """Return why a drawn start is refused, "" where it is fine: it must be solved and feasible."""
        if not evaluation.solved:
            return evaluation.reason
        if not evaluation.feasible(self.tolerance):
            return f"{self.constraint_names[int(np.argmax(evaluation.constraints))]} is not kept"
        return ""


@runtime_checkable
class Evaluate(Protocol):
    """What a solver calls: it evaluates, or repeats what was recorded, and keeps the account."""

    lower: Float[np.ndarray, "n"]
    upper: Float[np.ndarray, "n"]
    constraints: int

    def __call__(self, u: Float[np.ndarray, "n"], slopes: bool = False) -> Evaluation:
        """Return the evaluation of a design in the box."""
        ...

    def close_iteration(self) -> None:
        """Tell that an iteration of the solver ends with the last evaluation."""
        ...


@dataclass(frozen=True)
class Outcome:
    """How a solver ended; what it found is read off its evaluations."""

    converged: bool
    message: str


class Solver(ABC):
    """A way to minimise from one start; a frozen dataclass with its options as fields.

    It must ask for the same designs whenever it gets the same start, seed and evaluations: a run that was killed goes
    on by running the solver again on what was recorded.
    """

    slopes: ClassVar[bool] = False  # whether it asks for slopes everywhere

    @abstractmethod
    def solve(self, evaluate: Evaluate, start: Float[np.ndarray, "n"], seed: int) -> Outcome:
        """Minimise from `start`; `seed` is from 1 to 2^31 - 1."""


def require(fits: bool, message: str) -> None:
    """Raise ValueError with the message unless `fits`; for options of solvers."""
    if not fits:
        raise ValueError(message)

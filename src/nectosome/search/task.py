"""What is minimised: variables in the unit box, objectives and constraints, evaluations; plain functions as tasks."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError
from nectosome.units.ranges import Ranges

_NONE = np.zeros(0)
_NONE.setflags(write=False)


@dataclass(frozen=True, eq=False)
class Evaluation:
    """Objective and constraints at one design, or why there are none.

    An evaluation whose `reason` is not empty found no solution: objective and constraints are nan, and no optimiser may
    put a number in their place.
    """

    u: Float[np.ndarray, "n"]  # the design, in the unit box
    objective: float
    constraints: Float[np.ndarray, "m"]  # <= 0 where kept, in units of their limits
    gradient: Float[np.ndarray, "n"] | None = None  # of the objective
    jacobian: Float[np.ndarray, "m n"] | None = None  # of the constraints
    reason: str = ""
    outputs: Mapping[str, float] = field(default_factory=dict)  # what else is worth remembering, by name
    memory: Float[np.ndarray, "k"] | None = None  # what helps to evaluate a design nearby
    seconds: float = 0.0  # it took, filled in by the recorder
    others: Float[np.ndarray, "o"] = field(default_factory=lambda: _NONE)  # objectives beyond the first

    @classmethod
    def unsolved(cls, u: Float[np.ndarray, "n"], constraints: int, reason: str, others: int = 0) -> "Evaluation":
        """Return the evaluation of a design that has no solution, for a reason in words."""
        if not reason:
            raise ValueError("Evaluation: an unsolved design needs a reason.")
        return cls(u, np.nan, np.full(constraints, np.nan), reason=reason, others=np.full(others, np.nan))

    @property
    def solved(self) -> bool:
        """Whether there is a solution."""
        return not self.reason

    @property
    def objectives(self) -> Float[np.ndarray, "k"]:
        """All objectives, the first one first."""
        return np.concatenate([[self.objective], self.others])

    @property
    def violation(self) -> float:
        """By how much the worst constraint is broken: 0 where all are kept, inf without a solution."""
        return float(max(0.0, self.constraints.max(initial=0.0))) if self.solved else np.inf

    def feasible(self, tolerance: float) -> bool:
        """Return whether there is a solution that breaks no constraint by more than `tolerance`."""
        return self.violation <= tolerance


Evaluate = Callable[[Float[np.ndarray, "n"], bool, Float[np.ndarray, "k"] | None], Evaluation]
EvaluateBatch = Callable[[Float[np.ndarray, "m n"]], list[Evaluation]]


@dataclass(frozen=True)
class Space:
    """The numbers of a task's variables, constraints and objectives.

    - levels: how many values each variable takes, evenly from 0 to 1, 0 for one that takes all; empty where all do.
    """

    variables: int
    constraints: int = 0
    objectives: int = 1
    levels: tuple[int, ...] = ()

    @property
    def steps(self) -> Float[np.ndarray, "n"]:
        """Between neighbouring values of each variable, 0 where it takes all."""
        levels = np.array(self.levels or (0,) * self.variables)
        return np.where(levels > 1, 1 / np.maximum(levels - 1, 1), 0.0)

    def nearest(self, u: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Return the designs nearest to some that have values which their variables take."""
        steps = self.steps
        return np.where(steps > 0, np.rint(u / np.where(steps > 0, steps, 1.0)) * steps, u) if steps.any() else u


class Task(ABC):
    """Minimise an objective over the unit box, with constraints g(u) <= 0. It is pickled and sent to worker processes.

    - names: of the variables [n]; constraint_names: of the constraints [m].
    - objectives: how many there are; optimisers of one objective take the first.
    - levels: as `Space` has them.
    - tolerance: the violation up to which a design counts as feasible.
    """

    names: tuple[str, ...]
    constraint_names: tuple[str, ...] = ()
    objectives: int = 1
    levels: tuple[int, ...] = ()
    tolerance: ClassVar[float] = 1e-6

    @property
    def space(self) -> Space:
        """The numbers of variables, constraints and objectives."""
        return Space(len(self.names), len(self.constraint_names), self.objectives, self.levels)

    def check_derivatives(self) -> None:  # noqa: B027  most have them
        """Raise InputError where there are none."""

    @abstractmethod
    def key(self) -> str:
        """Return a text that is the same for the same task only, today and tomorrow."""

    @abstractmethod
    def prepare(self) -> Evaluate:
        """Return evaluate(u, derivatives, memory); called once in each worker, where programs are compiled.

        `memory` is that of the nearest design that this start has solved, None at first. For the same arguments
        `evaluate` always gives the same numbers; with `derivatives` a solved evaluation has gradient and Jacobian.
        """

    def prepare_batch(self) -> EvaluateBatch | None:
        """Return what evaluates a whole batch at once; None where designs are evaluated one by one."""
        return None

    def accepts(self, evaluation: Evaluation) -> str:
        """Return why a drawn start is refused, "" where it is fine: it must be solved and feasible."""
        if not evaluation.solved:
            return evaluation.reason
        if not evaluation.feasible(self.tolerance):
            return f"{self.constraint_names[int(np.argmax(evaluation.constraints))]} is not kept"
        return ""


@dataclass(frozen=True, eq=False)
class BatchTask(Task):
    """Minimise a function over the ranges of its parameters; it is evaluated a whole batch at once.

    - objective: rows of parameters [m, n] -> values [m], or [m, k] for k objectives. The number of rows may change from
      one batch to the next. inf says that a candidate has no value.
    - text: the same for the same objective only, today and tomorrow.

    Raises InputError for no parameter; for NaN and -inf, with the parameters that gave it. Raises ValueError for values
    of a wrong shape.
    """

    objective: Callable[[Float[np.ndarray, "m n"]], np.ndarray]
    ranges: Ranges
    objectives: int = 1
    text: str = ""
    names: tuple[str, ...] = field(init=False)

    def __post_init__(self) -> None:
        """Check what can be checked before anything is computed."""
        if not self.ranges.names:
            raise InputError("there is nothing to choose: at least one parameter is needed.")
        object.__setattr__(self, "names", self.ranges.names)

    def key(self) -> str:
        """Text of all that the numbers depend on."""
        ranges = self.ranges.bounds.tolist(), self.ranges.log.tolist()
        return f"{self.objectives} objective(s) over {self.names} {ranges}; {self.text}"

    def prepare(self) -> Evaluate:
        """Return what evaluates a batch of one."""
        return lambda u, derivatives, memory: self._evaluate(u[None])[0]

    def prepare_batch(self) -> EvaluateBatch:
        """Return what evaluates a batch."""
        return self._evaluate

    def check_derivatives(self) -> None:
        """Raise InputError: there are none."""
        raise InputError("this objective has no derivatives. Take an optimiser that needs none.", field="optimiser")

    def _evaluate(self, points: Float[np.ndarray, "m n"]) -> list[Evaluation]:
        rows = self.ranges.values(points)
        values = np.asarray(self.objective(rows.copy()), dtype=float)
        if values.ndim == 1 and self.objectives == 1:
            values = values[:, None]
        if values.shape != (len(rows), self.objectives):
            raise ValueError(
                f"the objective gives {values.shape} for {len(rows)} rows of {self.objectives} objective(s)."
            )
        wrong = np.flatnonzero((np.isnan(values) | (values == -np.inf)).any(axis=1))
        if wrong.size:
            at = self.ranges.text(rows[wrong[0]])
            raise InputError(f"the objective is no number at {at}. It may be inf where there is no value.")
        return [
            Evaluation(u, float(f[0]), np.zeros(0), others=f[1:])
            if np.isfinite(f).all()
            else Evaluation.unsolved(u, 0, "it has no value", self.objectives - 1)
            for u, f in zip(points, values, strict=True)
        ]

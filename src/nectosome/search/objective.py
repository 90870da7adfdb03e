"""A plain function of whole batches as a task: rows of parameters in, values out."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from jaxtyping import Float

from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .task import Evaluate, EvaluateBatch, Evaluation, Task


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

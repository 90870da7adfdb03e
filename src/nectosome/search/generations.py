"""Minimise what is rough, or has no derivatives, over a box: whole generations at a time, nothing lost when killed."""

import hashlib
import json
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import asdict
from pathlib import Path

import numpy as np
from jaxtyping import Float

from nectosome.io.atomic import reason
from nectosome.io.journal import Journal
from nectosome.units import InputError
from nectosome.units.ranges import Ranges

from .found import Evolved
from .populations import CmaEs, Evolver

Objective = Callable[[Float[np.ndarray, "m n"]], np.ndarray]
Progress = Callable[[int, float], bool | None]

FILE = "evolve.jsonl"


def evolve(
    objective: Objective,
    ranges: Ranges,
    solver: Evolver | None = None,
    *,
    evaluations: int = 10_000,
    target: float | None = None,
    seed: int = 0,
    key: str = "",
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> Evolved:
    """Minimise an objective over the box of its parameters.

    - objective: rows of parameters [m, n] -> values [m], or [m, k] for several objectives. It gets a whole generation,
      whose size may change. inf says that a candidate has no value: it is ranked last and never the best.
    - solver: `CmaEs` unless given; `ParetoFront` for several objectives.
    - evaluations: no generation is begun after so many; target: it ends with a value as low.
    - seed: the same one gives the same candidates.
    - key: a text that is the same for the same objective only, today and tomorrow.
    - folder: every generation is written there before the solver sees it. The same call with the same folder goes on
      where it ended, however it ended; it may ask for more evaluations or another target.
    - progress(evaluations, lowest value so far): called after each new generation; it is cancelled by False.

    Raises InputError for NaN, with the parameters that gave it, for a folder of other work, for options that make no
    sense, and where a package is not installed; ValueError for an objective of a wrong shape.
    """
    solver = CmaEs() if solver is None else solver
    if not ranges.names:
        raise InputError("there is nothing to choose: at least one parameter is needed.")
    if evaluations < 1:
        raise InputError(f"is {evaluations}; at least 1 is needed.", field="evaluations")
    if target is not None and solver.objectives > 1:
        raise InputError("is of one objective; there are several. Leave it out.", field="target")
    search = solver.search(len(ranges.names), seed)
    first = next(search)  # a solver that refuses does so before anything is written
    with _journal(folder, ranges, solver, seed, key) if folder is not None else nullcontext() as journal:
        record = _Record(objective, ranges, solver.objectives, journal)
        values, message, cancelled = None, "", False
        while not message:
            try:
                u = first if values is None else search.send(values)
            except StopIteration as end:
                message = end.value
                break
            values, new = record.evaluate(u)
            if target is not None and record.lowest <= target:
                message = f"the target of {target:g} is reached"
            elif record.count >= evaluations:
                message = f"{record.count} evaluations made"
            elif new and progress is not None and progress(record.count, record.lowest) is False:
                message, cancelled = "cancelled", True
        search.close()
        return record.result(message, cancelled)


def _journal(folder: str | Path, ranges: Ranges, solver: Evolver, seed: int, key: str) -> Journal:
    asked = {
        "solver": [type(solver).__name__, asdict(solver)],  # pyright: ignore[reportArgumentType]
        "names": ranges.names,
        "bounds": ranges.bounds.tolist(),
        "log": ranges.log.tolist(),
        "seed": seed,
        "key": key,
    }
    path = Path(folder)
    try:
        path.mkdir(parents=True, exist_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be used: {reason(error)}.", file=str(path)) from None
    return Journal(path / FILE, hashlib.sha256(json.dumps(asked, sort_keys=True).encode()).hexdigest())


class _Record:
    """Generations as they are made; those in the journal are handed back instead of evaluated."""

    def __init__(self, objective: Objective, ranges: Ranges, objectives: int, journal: Journal | None):
        self.count, self.lowest = 0, np.inf
        self._objective, self._ranges, self._k, self._journal = objective, ranges, objectives, journal
        self._recorded = journal.records if journal else []
        self._rows: list[np.ndarray] = []
        self._values: list[np.ndarray] = []

    def evaluate(self, u: Float[np.ndarray, "m n"]) -> tuple[Float[np.ndarray, "m k"], bool]:
        """Values at places of the unit box, and whether they are new."""
        rows, done = self._ranges.values(u), len(self._rows)
        new = done >= len(self._recorded)
        values = self._compute(rows) if new else self._recall(rows, self._recorded[done])
        if new and self._journal:
            told = [v.tolist() if np.isfinite(v).all() else None for v in values]
            self._journal.append({"rows": rows.tolist(), "values": told})
        self._rows.append(rows)
        self._values.append(values)
        self.count += len(rows)
        self.lowest = min(self.lowest, float(values[:, 0].min()))
        return values, new

    def result(self, message: str, cancelled: bool) -> Evolved:
        """All generations."""
        generation = np.repeat(np.arange(len(self._rows)), [len(rows) for rows in self._rows])
        note = self._journal.damage if self._journal else ""
        rows, values = np.concatenate(self._rows), np.concatenate(self._values)
        return Evolved(self._ranges.names, rows, values, generation, message, cancelled, note)

    def _compute(self, rows: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "m k"]:
        values = np.asarray(self._objective(rows.copy()), dtype=float)
        if values.ndim == 1 and self._k == 1:
            values = values[:, None]
        if values.shape != (len(rows), self._k):
            raise ValueError(f"the objective gives {values.shape} for {len(rows)} rows of {self._k} objective(s).")
        wrong = np.flatnonzero((np.isnan(values) | (values == -np.inf)).any(axis=1))
        if wrong.size:
            at = self._ranges.text(rows[wrong[0]])
            raise InputError(f"the objective is no number at {at}. It may be inf where there is no value.")
        return np.where(np.isfinite(values).all(axis=1, keepdims=True), values, np.inf)

    def _recall(self, rows: Float[np.ndarray, "m n"], record: dict) -> Float[np.ndarray, "m k"]:
        if rows.tolist() != record["rows"]:
            raise InputError(
                f"generation {len(self._rows) + 1} is not the one that the solver asks for now: it was recorded with "
                "other versions of nectosome or its solvers. Start anew, in another folder.",
                file=str(self._journal.path) if self._journal else None,
            )
        return np.array([[np.inf] * self._k if v is None else v for v in record["values"]], dtype=float)

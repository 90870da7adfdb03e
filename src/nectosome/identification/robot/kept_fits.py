"""Fits from starts, and where the one in progress is: the same fit goes on from there after it was killed."""

import hashlib
import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.file_system import entries, make_folder
from nectosome.io.journal import Journal
from nectosome.search.executors.spread import versions
from nectosome.units import InputError

from ..fits.misfit import Fit
from .misfit import RobotMisfit

_FILE = "starts.jsonl"


class KeptFits:
    """A journal of the fits from starts, in a folder if there is one.

    It is removed again where all is done, or refused, and no start led to a fit.

    - ended: the fit from each start by its number, or why there is none.
    - reached: parameters that the last step of a fit led to, by the number of its start; -1: after all starts.

    Raises InputError where the folder cannot be written, another process has it, or it is of another fit.
    """

    def __init__(self, folder: str | Path | None, problem: RobotMisfit, errors: Float[np.ndarray, "k"]):
        self.ended, self.reached = dict[int, Fit | InputError](), dict[int, Float[np.ndarray, "p"]]()
        self._folder, self._journal = None if folder is None else Path(folder), None
        if self._folder is not None:
            make_folder(self._folder)
            self._journal = Journal(self._folder / _FILE, _key(problem, errors))
            for record in self._journal.records:
                if "reached" in record:
                    self.reached[record["start"]] = np.array(record["reached"])
                else:
                    self._end(record["start"], _decoded(record))

    def keep(self, start: int, one: Fit | InputError) -> None:
        """Keep what came of a start."""
        self._end(start, one)
        if self._journal is not None:
            self._journal.append({"start": start, **_encoded(one)})

    def _end(self, start: int, one: Fit | InputError) -> None:
        self.ended[start] = one
        self.reached.pop(-1, None)  # it may come from a worse start

    def reach(self, start: int, theta: Float[np.ndarray, "p"]) -> None:
        """Keep where the fit from a start is."""
        if self._journal is not None:
            self._journal.append({"start": start, "reached": theta.tolist()})

    def __enter__(self) -> "KeptFits":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if self._folder is not None and self._journal is not None:
            self._journal.close()
            goes_on = kind is not None and not issubclass(kind, InputError)
            if not goes_on and not any(isinstance(one, Fit) for one in self.ended.values()):
                forget(self._folder)


def forget(folder: Path) -> None:
    """Remove what is kept of a fit, and its folder unless something else is in it."""
    (folder / _FILE).unlink(missing_ok=True)
    if not entries(folder):
        with suppress(OSError):
            folder.rmdir()


def _key(problem: RobotMisfit, errors: Float[np.ndarray, "k"]) -> str:
    """The same for the same fit only, however many starts it has."""
    digest = hashlib.sha256(json.dumps(versions()).encode())
    compared = [(one.column, one.text) for one in problem.compared]
    digest.update(f"{problem.variables} {compared} {errors.tolist()} {problem.bend}".encode())
    for trial in problem.trials:
        rows = ((), np.zeros(0)) if trial.rows is None else trial.rows
        said = trial.name, trial.starts, trial.released, trial.clocks, rows[0]
        digest.update(f"{trial.description.model_dump_json()} {said} {trial.measured.shape}".encode())
        for values in (trial.time, trial.measured, rows[1]):
            digest.update(np.ascontiguousarray(values).tobytes())
    return digest.hexdigest()


def _encoded(one: Fit | InputError) -> dict[str, Any]:
    if isinstance(one, Fit):
        return {"theta": one.theta.tolist(), "chi2": one.chi2}
    return {"reason": one.message, "field": one.field}


def _decoded(record: dict[str, Any]) -> Fit | InputError:
    if "theta" in record:
        return Fit(np.array(record["theta"]), record["chi2"])
    return InputError(record["reason"], field=record["field"])

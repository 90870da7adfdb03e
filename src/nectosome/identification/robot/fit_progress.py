"""A fit in progress: how far it is, what it costs and has found, and its starts, kept so that a killed one goes on."""

import hashlib
import json
from collections.abc import Callable, Mapping, Sequence, Sized
from concurrent.futures import CancelledError
from contextlib import suppress
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.designs.kept_parts import Progress
from nectosome.io.file_system import entries, make_folder
from nectosome.io.journal import Journal
from nectosome.search.executors.spread import versions
from nectosome.units import InputError, show_quantity

from ..fits.errors import range_errors
from ..fits.misfit import Fit
from .misfit import DERIVATIVES, READINGS, RobotMisfit

FORECAST = "an evaluation takes"  # begins the words of what a fit will cost
_LONG = 10.0  # s of processor time: what a fit costs is said where it takes longer
_START, _FIT, _CLOCKS = (8, 3), (20, 5), (12, 4)  # evaluations, and those with derivatives, as fits usually take
_FILE = "starts.jsonl"


class FitSoFar(NamedTuple):
    """The best that a fit has found before its end: no result, it may still move, and nothing says how sure it is."""

    values: dict[str, float]  # of all that is unknown [SI]
    shown: dict[str, str]  # these, as people read them
    off: dict[str, float]  # root mean square error of each column [percent of its range]
    recordings: tuple[int, int]  # that these errors are of, of how many

    @property
    def words(self) -> str:
        """Values with their units, and errors."""
        found = ", ".join(f"{name} = {text}" for name, text in self.shown.items())
        errors = ", ".join(f"{column} off by {off:.3g} %" for column, off in self.off.items())
        few, all_ = self.recordings
        return f"{found}; {errors} of its range{f' in {few} of {all_} recordings' if few < all_ else ''}"


class FitStoppedError(CancelledError):
    """A fit was stopped; `best` is what it had found, None before its first step."""

    def __init__(self, best: FitSoFar | None):
        super().__init__("the fit was stopped")
        self.best = best


class FitProgress:
    """Share done of a fit, whose starts take a few of the recordings."""

    def __init__(self, progress: Progress | None, problem: RobotMisfit, few: RobotMisfit):
        self._progress, self._problem, self._problem_of_starts = progress, problem, few
        self._few = len(few.trials) / len(problem.trials)
        self._dear = 6.0 + len(problem.variables)  # evaluations that one with derivatives takes
        self._parts, self._starts = list[float](), 0
        self._words, self._part, self._units_done, self._count = "", 0, 0.0, 0
        self._best: FitSoFar | None = None
        self._least = np.inf  # chi2 of the best start so far

    def begin_starts(self, starts: int, ended: Mapping[int, Fit | InputError]) -> None:
        """Report that so many starts are to be made, of which some have ended. Raises FitStoppedError."""
        self._starts = starts
        self._parts = [self._few * self._units(*_START)] * starts + [self._units(*_FIT), self._units(*_CLOCKS)]
        self.begin_next(ended)
        fits = {k: one for k, one in ended.items() if isinstance(one, Fit)}
        if fits:
            k = min(fits, key=lambda k: fits[k].chi2)
            self.reach(k, fits[k].theta, fits[k].chi2)

    def begin_next(self, ended: Sized) -> bool:
        """Report that the next start begins. Raises FitStoppedError; to go on is True."""
        number = f"start {min(len(ended) + 1, self._starts)} of {self._starts}"
        self.begin(number if self._starts > 1 else "fitting", len(ended))
        return True

    def begin(self, words: str, part: int) -> None:
        """Report that a part begins: a start, by its number, then the fit, the clocks. Raises FitStoppedError."""
        self._words, self._part, self._units_done = words, part, 0.0
        self.report(words)

    def each(self, what: str, seconds: float) -> None:
        """Report an evaluation."""
        share = self._few if self._part < self._starts else 1.0
        self._units_done += share * (self._dear if what == DERIVATIVES else 1.0)
        self._count += what == READINGS
        usual = self._starts * _START[0] + _FIT[0] + _CLOCKS[0]
        of = f" of about {usual}" if self._count <= usual else ""
        self.report(f"{self._words}, evaluation {self._count}{of}")

    def reach(self, start: int, theta: Float[np.ndarray, "p"], chi2: float) -> None:
        """Take what a step of a start led to, or, where that is -1, one of the fit that follows them."""
        if self._progress is not None and (start < 0 or chi2 < self._least):
            problem, self._least = (self._problem, 0.0) if start < 0 else (self._problem_of_starts, chi2)
            self._best = _so_far(problem, theta, len(self._problem.trials))

    def report(self, words: str) -> None:
        """Report what is done and the share. Raises FitStoppedError where the fit is not to go on."""
        gone, part = sum(self._parts[: self._part]), self._parts[self._part]
        share = (gone + min(self._units_done, part)) / sum(self._parts)
        best = "" if self._best is None else f"; best so far {self._best.words}"
        if self._progress is not None and self._progress(f"{words}{best}", share) is False:
            raise FitStoppedError(self._best)

    def forecast(self, seconds: float, slow: Sequence[str] = ()) -> None:
        """Say what a fit costs whose evaluation takes so long [s], where that is much, and what makes it slow."""
        total = sum(self._parts) * seconds
        if self._progress is not None and total > _LONG:
            runs, dear = (
                round(self._starts * self._few * a) + b + c for a, b, c in zip(_START, _FIT, _CLOCKS, strict=True)
            )
            each = f"{seconds:.2g} s of processor time, with derivatives about {self._dear * seconds:.2g} s"
            said = f"{FORECAST} {each}; about {runs} and {dear} of them, {total:.2g} s in all"
            self._progress(". ".join([said, *slow]), 0.0)

    def _units(self, runs: int, dear: int) -> float:
        return runs + dear * self._dear


def _so_far(problem: RobotMisfit, theta: Float[np.ndarray, "p"], recordings: int) -> FitSoFar:
    """Parameters of a problem, and what they leave of each column: what is computed of them is kept from their step."""
    pairs = [*zip(problem.variables, theta.tolist(), strict=True)]
    left, off = problem.residuals(theta), dict[str, float]()
    for c, one in enumerate(problem.compared):
        measured = np.concatenate([trial.measured[c] for trial in problem.trials])
        error = np.concatenate([rows[c] for rows in left])
        there = np.isfinite(error)
        if there.any() and np.ptp(measured[there]) > 0:
            off[one.column] = range_errors(measured[there] + error[there], measured[there])[0]
    shown = {v.name: show_quantity(x, v.dimension) for v, x in pairs}
    return FitSoFar({v.name: x for v, x in pairs}, shown, off, (len(problem.trials), recordings))


class KeptFits:
    """A journal of the fits from starts, in a folder if there is one.

    It is removed again where all is done, or refused, and no start led to a fit.

    - ended: the fit from each start by its number, or why there is none.
    - reached: parameters that the last step of a fit led to, by the number of its start; -1: after all starts, of all
      recordings.

    What comes in is told to `tell`: a start, -1 after all, its parameters and chi2.

    Raises InputError where the folder cannot be written, another process has it, or it is of another fit.
    """

    def __init__(
        self,
        folder: str | Path | None,
        problem: RobotMisfit,
        errors: Float[np.ndarray, "k"],
        tell: Callable[[int, Float[np.ndarray, "p"], float], None],
    ):
        self._tell = tell
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
        if isinstance(one, Fit):
            self._tell(start, one.theta, one.chi2)
        if self._journal is not None:
            self._journal.append({"start": start, **_encoded(one)})

    def _end(self, start: int, one: Fit | InputError) -> None:
        self.ended[start] = one
        self.reached.pop(-1, None)  # it may come from a worse start

    def reach(self, start: int, theta: Float[np.ndarray, "p"], chi2: float) -> None:
        """Keep where the fit from a start is."""
        self._tell(start, theta, chi2)
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

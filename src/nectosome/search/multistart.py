"""Minimise from one start, or from many in parallel, so that nothing is lost when the process is killed."""

import time
from collections import Counter
from collections.abc import Callable, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Float

from nectosome.io.file_system import exists
from nectosome.io.journal import Journal, read_journal
from nectosome.units import InputError

from .contract import Optimiser, Outcome
from .evaluations import Recorder, StoppedError, decode
from .executors.afar import Drivers, prepared
from .executors.processes import Workers, processors, stopped
from .executors.spread import LostError
from .history import Result, Start
from .search_folder import SearchFolder
from .task import Evaluation, Task

Progress = Callable[[int, Evaluation | None, int, float], bool | None]

_PULSE = 0.5  # seconds between calls of progress
_READING = 0.05  # share of the time in which journals are read
_SURE = 0.8  # share of the likely evaluations up to which they count in full


def multistart(
    task: Task,
    optimiser: Optimiser,
    starts: int,
    seed: int = 1,
    *,
    first: Float[np.ndarray, "n"] | None = None,
    folder: str | Path | None = None,
    about: Mapping[str, Any] | None = None,
    draws: int = 200,
    executor: Executor | None = None,
    workers: int | None = None,
    share: tuple[int, int] = (1, 1),
    progress: Progress | None = None,
) -> Result:
    """Minimise from `starts` designs, drawn evenly from the box until the task accepts one.

    - seed: start k is the same whatever the number of starts and workers.
    - first: a design of the box from which start 0 begins, instead of a drawn one, where the task accepts it.
    - folder: every evaluation is written there at once. The same call with the same folder goes on where it ended,
      however it ended; with more starts it adds some.
    - about: JSON data to keep in the folder's `search.json`, where `read_search` finds it.
    - draws: a start is given up when so many designs were refused.
    - executor: where evaluations are made: any of `concurrent.futures`, or a cluster; starts then run in threads of
      this process, which writes their journals. Spawned processes unless given, one a processor, or `workers` of them.
    - share: (k, n) makes every nth start only, beginning with the kth; `gather_starts` joins their folders.
    - progress(starts done, best so far, evaluations, share of the likely work): called twice a second; the run is
      cancelled where it returns False. The likely work is that of the starts that are done, else what the optimiser
      usually takes. The best of starts under way counts where there is a folder.

    Cancelled, the result holds the starts that are done, and those of a folder as far as they came.

    Raises ValueError for numbers that make no sense, InputError for a folder that cannot be used and an optimiser that
    cannot search this task, LostError where a worker process died, or the executor ended.
    """
    counts = {"starts": (starts, 1), "seed": (seed, 0), "draws": (draws, 1)}
    if workers is not None:
        counts["workers"] = workers, 1
    for name, (number, least) in counts.items():
        if number < least:
            raise ValueError(f"multistart: {name} is {number}; it must be at least {least}.")
    optimiser.check_task(task, True)
    with (
        nullcontext()
        if folder is None
        else SearchFolder(folder, task, optimiser, seed, starts=starts, draws=draws, about=about)
    ) as held:
        jobs = [
            _Job(task, optimiser, seed, k, draws, None if k else first, held.journal(k) if held else None)
            for k in range(share[0] - 1, starts, share[1])
        ]
        done = {job.number: start for job in jobs if (start := job.recall()) is not None}
        left = [job for job in jobs if job.number not in done]
        cancelled = False
        if left:
            number = min(workers or processors(), len(left))
            cancelled = _Starts(left, done, progress).go(executor, number)
            if cancelled:
                done |= {job.number: start for job in left if job.number not in done and (start := job.so_far())}
    return Result(tuple(done[k] for k in sorted(done)), task.names, task.constraint_names, cancelled)


@dataclass(frozen=True)
class _Job:
    """One start, as it is sent to a worker."""

    task: Task
    optimiser: Optimiser
    seed: int
    number: int
    draws: int
    first: Float[np.ndarray, "n"] | None
    journal: tuple[Path, str] | None  # path and key

    def recall(self) -> Start | None:
        """The start as its journal has it, None where it did not come to its end."""
        if self.journal is None or not exists(self.journal[0]):
            return None
        return self._recorded(*read_journal(*self.journal))

    def so_far(self) -> Start | None:
        """The start as far as its journal has it, as one that was cancelled; None without an evaluation."""
        if self.journal is None or not exists(self.journal[0]):
            return None
        records, note = read_journal(*self.journal)
        evaluations = [e for record in records if "end" not in record for e in decode(record)]
        if not evaluations:
            return None
        refused = [self.task.accepts(e) for e in evaluations]
        begun = "" in refused
        draws = refused.index("") + 1 if begun else len(evaluations)
        end = {"draws": draws, "begun": begun, "rejected": Counter(filter(None, refused[:draws]))}
        end |= {"marks": [], "converged": False, "message": "cancelled", "cancelled": True}
        return self._start(evaluations, end, note)

    def run(self, task: Task, stop: Callable[[], bool]) -> Start | None:
        """Run or go on with the start by evaluations of `task`; None where it was stopped."""
        if stop():
            return None
        with Journal(*self.journal) if self.journal else nullcontext() as journal:
            if journal and (done := self._recorded(journal.records, journal.damage)):
                return done

            def before() -> None:
                if stop():
                    raise StoppedError

            evaluate = prepared(task, task.key()) if task is self.task else None  # one of a worker is used again
            recorder = Recorder(task, evaluate, journal, before)
            try:
                end = self._search(recorder)
            except StoppedError:
                return None
            if journal:
                journal.append({"end": end})
            return self._start(recorder.evaluations, end, journal.damage if journal else "")

    def _search(self, recorder: Recorder) -> dict[str, Any]:
        """Draw a start and search from it; what is not in the evaluations, as JSON data."""
        sequence = np.random.SeedSequence(self.seed, spawn_key=(self.number,))
        rng = np.random.default_rng(sequence)
        refused: Counter[str] = Counter()
        accepted = None
        while accepted is None and refused.total() < self.draws:
            drawn = rng.uniform(size=len(self.task.names))
            u = drawn if self.first is None or refused else self.first
            (e,) = recorder(u[None], self.optimiser.derivatives)
            why = self.task.accepts(e)
            if why:
                refused[why] += 1
            else:
                accepted = e.u
        end = {"draws": len(recorder.evaluations), "begun": accepted is not None, "rejected": dict(refused)}
        if accepted is None:
            common = refused.most_common(1)[0][0]
            message = f"none of {self.draws} drawn designs was accepted, mostly because {common}"
            return end | {"marks": [], "converged": False, "message": message}
        seed = 1 + int(sequence.generate_state(1)[0]) % (2**31 - 1)
        outcome = recorder.drive(self.optimiser.search(self.task.space, accepted, seed))
        return end | {"marks": recorder.marks, "converged": outcome.converged, "message": outcome.message}

    def _start(self, evaluations: list[Evaluation], end: dict[str, Any], note: str) -> Start:
        ended: dict[str, Any] = end | {"marks": tuple(end["marks"])}
        return Start(self.number, tuple(evaluations), tolerance=self.task.tolerance, note=note, **ended)

    def _recorded(self, records: list[dict[str, Any]], note: str) -> Start | None:
        """The start of a journal; None where it did not come to its end."""
        if not records or "end" not in records[-1]:
            return None
        return self._start([e for record in records[:-1] for e in decode(record)], records[-1]["end"], note)


class _Starts:
    """Starts on their way through an executor."""

    def __init__(self, jobs: list[_Job], done: dict[int, Start], progress: Progress | None):
        self.jobs, self.done, self.progress = jobs, done, progress
        self.total = len(jobs) + len(done)
        self.cancelled = False
        self.under_way = list[Start]()
        self.read_next = 0.0  # time

    def go(self, executor: Executor | None, number: int) -> bool:
        """Run all, so many at once; say whether it was cancelled."""
        self.at_once = number
        if executor is None:
            with Workers(number) as workers:
                self._through(workers, lambda job: workers.pool.submit(_run_in_worker, job))
        else:
            with Drivers(self.jobs[0].task, executor, len(self.jobs)) as drivers:
                self._through(drivers, lambda job: drivers.pool.submit(job.run, drivers.task, drivers.stop.is_set))
        return self.cancelled

    def _through(self, crew: Workers | Drivers, submit: Callable[[_Job], Future[Start | None]]) -> None:
        futures: set[Future[Start | None]] = set()
        try:
            for job in self.jobs:
                futures.add(submit(job))
            before = sum(len(start.evaluations) for start in self.done.values())
            waiting = futures
            while waiting and not self.cancelled:
                finished, waiting = wait(waiting, timeout=_PULSE, return_when=FIRST_COMPLETED)
                self._collect(finished)
                made = sum(len(start.evaluations) for start in self.done.values())
                evaluations = max(made, before + crew.computed)
                crew.tell_compiling()
                if self.progress is not None:
                    state = len(self.done), self._best(), evaluations, self._share(evaluations - made)
                    if self.progress(*state) is False:
                        self.cancelled = bool(waiting)
                        break
        except BrokenProcessPool:
            raise LostError(
                "a worker process died, perhaps for want of memory. With a folder, the same call goes on from there."
            ) from None
        finally:
            crew.stop.set()
            # none is cancelled: a pool whose worker ends never resolves its other futures then (Python 3.11)
            wait(futures)  # starts in threads stop at their next evaluation, our workers soon
        self._collect({future for future in futures if not isinstance(future.exception(), BrokenProcessPool)})

    def _collect(self, futures: set[Future[Start | None]]) -> None:
        for future in futures:
            start = future.result()
            if start is not None:
                self.done[start.number] = start

    def _share(self, evaluations: int) -> float:
        """Share of the likely work, after so many evaluations of starts under way; the first of these count most."""
        ended = [len(start.evaluations) for start in self.done.values()]
        job, left = self.jobs[0], self.total - len(ended)
        likely = sum(ended) / len(ended) if ended else job.optimiser.likely(job.task.space)
        running = min(left, self.at_once)
        part = evaluations / max(running * likely, 1)
        part = part if part < _SURE else 1 - _SURE * (1 - _SURE) / part
        return (len(ended) + running * part) / self.total

    def _best(self) -> Evaluation | None:
        now = time.monotonic()
        if now >= self.read_next:
            self.under_way = [s for job in self.jobs if job.number not in self.done and (s := job.so_far())]
            self.read_next = now + (time.monotonic() - now) / _READING
        bests = [s.best for s in (*self.done.values(), *self.under_way) if s.best is not None]
        return min(bests, key=lambda e: e.objective, default=None)


def _run_in_worker(job: _Job) -> Start | None:
    return job.run(job.task, stopped)


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

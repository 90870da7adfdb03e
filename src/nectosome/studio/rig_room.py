"""The rig that a studio drives: one at a time, as two rig files may name the same device. All tabs see it."""

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace

import numpy as np
from jaxtyping import Float

from nectosome.rigs.log import JournalTail
from nectosome.units import InputError

from .rig_process import RigEnd, RigOrder, RigProcess
from .work import Progress, SolverThread

_PULSE = 0.05  # s between looks at the process
_NEWS = 0.5  # s between what is shown of it
_LONG = 5.0  # s from a stop, after which somebody should look at the rig
_BY_HAND = "it does not end; if anything moves, TAKE ITS POWER OUT BY HAND"


@dataclass(frozen=True)
class RigNews:
    """What is known of a run: the last rows of its log, with the units of their columns, and its end, once it has one.

    `number` counts the runs of a studio.
    """

    number: int
    rig: str
    total: float  # length [s]
    units: dict[str, str]
    rows: Float[np.ndarray, "n columns"]
    end: RigEnd | None = None


Watcher = Callable[[RigNews], None]


class RigRoom:
    """Rigs of a studio."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._taken = ""  # by which rig
        self._number = 0
        self._process: RigProcess | None = None
        self._stopped = False
        self._free = threading.Event()
        self._free.set()
        self._news: RigNews | None = None
        self._watchers: list[Watcher] = []

    @contextmanager
    def taken(self, rig: str) -> Iterator[None]:
        """Have all rigs to oneself. Raises InputError while somebody else has one."""
        with self._lock:
            if self._taken:
                raise InputError(
                    f"the rig {self._taken} is in use in this studio, by this page or another one. One rig runs at a "
                    "time: wait for its end, or press STOP."
                )
            self._taken = rig
            self._free.clear()
        try:
            yield
        finally:
            with self._lock:
                self._taken = ""
            self._free.set()

    def run(self, rig: str, order: RigOrder, total: float, window: int, progress: Progress) -> RigEnd:
        """Run to the end, `total` [s] long; watchers see the last `window` rows. It ends when `progress` is False.

        Raises InputError where another rig is in use, and where the run cannot begin.
        """
        tail, news = JournalTail(order.log.with_suffix(".csv"), window), None
        end = RigEnd("failed", "it did not begin.", None)
        try:
            with self.taken(rig):
                with self._lock:
                    self._number += 1
                    self._stopped = False
                    news = self._news = RigNews(self._number, rig, total, {}, np.zeros((0, 0)))
                    self._process = RigProcess(order)
                end = self._ended(self._process, tail, news, progress)
        finally:
            if news is not None:
                with self._lock:
                    self._process, self._news = None, None
                self._show(replace(_with_rows(news, tail), end=end))
        return end

    def stop(self) -> None:
        """End the run, if there is one, as its experiment does: by a ramp to 0 and without power."""
        with self._lock:
            process, self._stopped = self._process, True
        if process is not None:
            process.stop()

    def watch(self, watcher: Watcher) -> None:
        """Call it with all news, in threads; at once where a run goes on."""
        with self._lock:
            self._watchers.append(watcher)
            news = self._news
        if news is not None:
            watcher(news)

    def unwatch(self, watcher: Watcher) -> None:
        """Call it no more."""
        with self._lock, suppress(ValueError):
            self._watchers.remove(watcher)

    def wait(self) -> None:
        """Wait until no rig is in use."""
        self._free.wait()

    def _ended(self, process: RigProcess, tail: JournalTail, news: RigNews, progress: Progress) -> RigEnd:
        """Wait for the end of a run; a thread of its own tells of it meanwhile, with the newest rows."""
        shown, pulses, since = SolverThread(self._show), 0, 0.0
        shown.submit(news)
        try:
            while (end := process.ended(_PULSE)) is None:
                pulses += 1
                if pulses % round(_NEWS / _PULSE) == 0:
                    tail.read()
                    if tail.rows:
                        shown.submit(_with_rows(news, tail))
                since += _PULSE if self._stopped else 0.0
                share = tail.rows[-1][0] / news.total if tail.rows else 0.0
                if not progress(self._words(tail, news.total, since), share) and not self._stopped:
                    self.stop()
        finally:
            shown.close()
        return end

    def _words(self, tail: JournalTail, total: float, since: float) -> str:
        if since > _LONG:
            return _BY_HAND
        if self._stopped:
            return "ending"
        return f"{tail.rows[-1][0]:.1f} of {total:.1f} s" if tail.rows else "beginning"

    def _show(self, news: RigNews) -> None:
        with self._lock:
            watchers = [*self._watchers]
        for watcher in watchers:
            watcher(news)


def _with_rows(news: RigNews, tail: JournalTail) -> RigNews:
    return replace(news, units=dict(tail.units), rows=np.array([*tail.rows]).reshape(len(tail.rows), len(tail.units)))

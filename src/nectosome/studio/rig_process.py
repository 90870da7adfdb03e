"""A run on a rig in a process of its own: nothing that the studio does takes time from its samples.

A pipe leads to it. The run ends safely when a word comes through that, and when the studio is there no more, killed or
not: then the pipe ends. What a signal to the process itself does, `Experiment` says.
"""

import multiprocessing
import signal
import threading
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from nectosome.io.file_system import exists
from nectosome.units import InputError

if TYPE_CHECKING:
    from nectosome.rigs import Experiment, Limits, Loop, Rig
    from nectosome.rigs.laws import Signal

_LOST = (
    "the process that drove the rig has ended without a word, and the last commands may be in effect: "
    "TAKE ITS POWER OUT BY HAND. What was measured is in {}."
)


@dataclass(frozen=True)
class RigOrder:
    """What is run: signals by command, or loops by command, on the rig that `make` makes there; all can be pickled.

    - make: returns what has `rig`, `limits` and `dt`, as `load_rig` does.
    - log: where it is logged; `name` is that of the signals or references.
    """

    make: Callable[[], Any]
    log: Path
    name: str
    signals: "Mapping[str, Signal] | None" = None
    loops: "Mapping[str, Loop] | None" = None

    def experiment(self) -> "Experiment":
        """The experiment. Raises InputError for what does not fit the rig."""
        from nectosome.rigs import Experiment, Played, Tracked

        file = self.make()
        rig: Rig = file.rig
        limits: Limits = file.limits
        law = Tracked(rig, self.loops, file.dt) if self.loops is not None else Played(rig, self.signals or {})
        return Experiment(rig, law, limits, file.dt, self.name)


@dataclass(frozen=True)
class RigEnd:
    """How a run ended: a status of `Experiment`, the reason in a sentence, and the log, where there is one."""

    status: str
    reason: str
    path: Path | None


class RigProcess:
    """The studio's end of the pipe, of a run that begins at once."""

    def __init__(self, order: RigOrder):
        spawned = multiprocessing.get_context("spawn")
        self._order = order
        self._pipe, theirs = spawned.Pipe()
        self._sending = threading.Lock()
        # no daemon: that would be killed at the end of this program, before the rig is safe
        self._process = spawned.Process(target=_run, args=(theirs, order), name="rig", daemon=False)
        self._process.start()
        theirs.close()

    def stop(self) -> None:
        """Tell the run to end; it does within a tenth of a second, by its ramp to 0. May be called again."""
        with self._sending, suppress(OSError):  # it has ended
            self._pipe.send("stop")

    def ended(self, seconds: float) -> RigEnd | None:
        """How it ended, or None where it does not within so long.

        Raises InputError where it could not begin, and RuntimeError for an error of the program, when all is safe.
        """
        if not self._pipe.poll(seconds):
            return None
        try:
            kind, *answer = self._pipe.recv()
        except (EOFError, OSError):
            kind, answer = "lost", []
        self._process.join()
        with self._sending:
            self._pipe.close()
        if kind == "refused":
            message, file, line, field = answer
            raise InputError(message, file=file, line=line, field=field)
        if kind == "crashed":
            raise RuntimeError(answer[0])
        if kind == "lost":
            journal = self._order.log.with_suffix(".csv")
            if not exists(journal):  # there is one before the rig is opened
                raise RuntimeError("the process that drives the rig could not begin; no command was sent.")
            return RigEnd("failed", _LOST.format(journal.name), None)
        return RigEnd(*answer)


def _run(pipe: Connection, order: RigOrder) -> None:
    """Run it, in the process; what it answers is the last that it does."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C goes to the studio as well, which ends this
    stopped = threading.Event()
    threading.Thread(target=_listen, args=(pipe, stopped), daemon=True).start()
    answer: tuple[Any, ...]
    try:
        experiment = order.experiment()
        if stopped.is_set():
            answer = "ended", "interrupted", "it was stopped before it began; no command was sent.", None
        else:
            run = experiment.run(order.log, lambda _: not stopped.is_set())
            answer = "ended", run.status, run.reason, run.path
    except InputError as error:
        answer = "refused", error.message, error.file, error.line, error.field
    except BaseException:  # the process ends: no error may be lost, of whatever kind
        answer = "crashed", traceback.format_exc()
    with suppress(OSError):  # the studio is there no more
        pipe.send(answer)


def _listen(pipe: Connection, stopped: threading.Event) -> None:
    """Wait for a word, or for the end of the pipe."""
    with suppress(EOFError, OSError):
        pipe.recv()
    stopped.set()

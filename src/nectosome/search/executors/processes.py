"""Processes that run starts: spawned, not interrupted by Ctrl-C, and ended with the process that began them.

After a request to stop they end at their next evaluation. One that is far from it, as while it compiles, is killed:
what it had computed before is in its journal.
"""

import multiprocessing
import os
import signal
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from typing import Any

_stop: Any = None  # in a worker: the event that says stop
_count: Any = None  # in a worker: the shared number of evaluations computed
_compiling: Any = None  # in a worker: the shared number of workers that compile


_PULSE, _LONGEST = 0.25, 3.0  # s between looks whether to stop, and from then on to the end
_WORKERS = "in workers"  # among the functions that a process compiles
# the tracker of semaphores is a process of its own, which tells on stderr that this one was killed
_QUIET = "ignore:resource_tracker:UserWarning"
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NPROC")  # NPROC is read by XLA


class Workers:
    """A pool of spawned processes, with an event that stops them, a count of what they compute, and who compiles.

    Their linear algebra and XLA have one thread each, unless the environment says otherwise: theirs are small matrices,
    and many threads on few processors wait for each other.
    """

    def __init__(self, number: int):
        if _QUIET not in sys.warnoptions:
            sys.warnoptions.append(_QUIET)  # processes that Python starts take these options over
        context = multiprocessing.get_context("spawn")
        self.stop = context.Event()
        self._count = context.Value("q", 0)
        self._compiling = context.Value("q", 0)
        self.pool = ProcessPoolExecutor(number, context, _begin, (self.stop, self._count, self._compiling))

    def __enter__(self) -> "Workers":
        # the libraries read it when they are loaded, which is before any code of ours
        self._ours = [name for name in _THREADS if name not in os.environ]
        os.environ.update(dict.fromkeys(self._ours, "1"))
        return self

    def __exit__(self, *_: object) -> None:
        for name in self._ours:
            os.environ.pop(name, None)
        _compiling_here().discard(_WORKERS)
        self.pool.shutdown(cancel_futures=True)

    @property
    def computed(self) -> int:
        """Evaluations computed so far."""
        return self._count.value

    def tell_compiling(self) -> None:
        """Let this process count as compiling while its workers do, so that progress says so."""
        here = _compiling_here()
        (here.add if self._compiling.value > 0 else here.discard)(_WORKERS)


def _compiling_here() -> set[str]:
    """The functions that this process compiles now; JAX is not loaded for that."""
    return getattr(sys.modules.get("nectosome.core.programs.remember"), "compiling", set())


def stopped() -> bool:
    """Return whether this process is a worker that has a request to stop."""
    return _stop is not None and _stop.is_set()


def count(evaluations: int) -> None:
    """Count evaluations, where this process is a worker."""
    if _count is not None:
        with _count.get_lock():
            _count.value += evaluations


def processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begin(stop: Any, count: Any, compiling: Any) -> None:
    global _stop, _count, _compiling
    _stop, _count, _compiling = stop, count, compiling
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches all; the parent decides
    threading.Thread(target=_follow_parent, daemon=True).start()
    threading.Thread(target=_follow_stop, daemon=True).start()


def _follow_stop() -> None:
    """End this process where it goes on after a request to stop; until then tell whether it compiles."""
    told = 0
    while not stopped():
        now = int(bool(_compiling_here()))
        with _compiling.get_lock():
            _compiling.value += now - told
        told = now
        time.sleep(_PULSE)
    time.sleep(_LONGEST)
    os._exit(1)


def _follow_parent() -> None:
    """End this process with its parent, which cannot say goodbye when it is killed."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)

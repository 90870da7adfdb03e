"""Calls through any executor: of threads, of processes, of a cluster; results are handed out as they come in.

The process that asks keeps what comes in, so that a worker, a scheduler or this process takes no more with it than what
is being computed when it ends.
"""

import socket
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import BrokenExecutor, CancelledError, Executor, Future
from functools import cache
from importlib.metadata import version
from itertools import islice
from queue import Empty, SimpleQueue
from typing import Any, TypeVar

from nectosome.units import InputError

_K = TypeVar("_K")
_PULSE = 0.5  # s between looks whether to go on
_AHEAD = 4096  # calls that wait in an executor: a scheduler holds the arguments of all
_SAME = ("nectosome", "jax", "jaxlib", "numpy")  # packages on whose versions numbers depend


class LostError(RuntimeError):
    """An executor ended, or lost its workers, before its calls were done."""


def submit(executor: Executor, f: Callable[..., Any], *args: Any) -> Future[Any]:
    """Submit f(*args) to any executor; see `result`. A worker of other versions refuses it by an InputError.

    Raises InputError for what is no executor.
    """
    if not isinstance(executor, Executor):
        words = f"is {executor!r}; an executor is needed. nectosome.search.cluster makes one of a scheduler's address."
        raise InputError(words, field="executor")
    try:
        return executor.submit(_call, versions(), f, args)
    except BrokenExecutor:
        raise LostError(_DIED) from None
    except RuntimeError:  # what executors raise after their end, and clients without a scheduler
        raise LostError("the executor ended before all was computed.") from None


def result(future: Future[Any]) -> Any:
    """Result of a call that has ended. Raises LostError where its worker or its scheduler died."""
    try:
        return future.result()
    except CancelledError:
        raise LostError("the connection to the scheduler was lost.") from None
    except BrokenExecutor:
        raise LostError(_DIED) from None
    except Exception as error:
        if type(error).__name__ != "KilledWorker":  # Dask's, which is not loaded for that
            raise
        raise LostError(
            "workers died again and again at one computation, perhaps for want of memory. Where they are ended by "
            "others, let the scheduler try more often: DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES=100."
        ) from None


def spread(
    executor: Executor, calls: Iterable[tuple[_K, Callable[..., Any], tuple[Any, ...]]], going: Callable[[], bool]
) -> Iterator[tuple[_K, Any]]:
    """Yield key and result of calls (key, function, arguments) as they come in, in any order.

    going(): asked twice a second and after each result, whether to go on. Where not, nothing new begins; what is being
    computed is yielded too where the executor tells of it, as those of Python do.

    Raises the first error of a call, and LostError.
    """
    waiting = dict[Future[Any], _K]()
    ended = SimpleQueue[Future[Any]]()
    more = iter(calls)
    try:
        while True:
            for key, f, args in islice(more, _AHEAD - len(waiting)):
                future = submit(executor, f, *args)
                waiting[future] = key
                future.add_done_callback(ended.put)
            if not waiting:
                return
            try:
                future = ended.get(timeout=_PULSE)
            except Empty:
                future = None
            if future in waiting:
                yield waiting.pop(future), result(future)
            if not going():
                more = iter(())
                waiting = {future: key for future, key in waiting.items() if not future.cancel()}
    finally:
        for future in waiting:
            future.cancel()


@cache
def versions() -> dict[str, str]:
    """Versions on which the numbers of this process depend."""
    return {name: version(name) for name in _SAME}


def check_versions(theirs: dict[str, str | None], where: str) -> None:
    """Raise InputError where the versions of a worker are not those of this process, with both."""
    for name, ours in versions().items():
        if theirs.get(name) != ours:
            there = theirs.get(name) or "none"
            raise InputError(f"the worker {where} has {name} {there}, and {ours} is here. Install the same for both.")


_DIED = "a worker process died, perhaps for want of memory."


def _call(theirs: dict[str, str], f: Callable[..., Any], args: tuple[Any, ...]) -> Any:
    """f(*args), in a worker."""
    if theirs != versions():
        name = next(name for name, ours in versions().items() if theirs.get(name) != ours)
        raise InputError(
            f"the worker on {socket.gethostname()} has {name} {versions()[name]}, and {theirs.get(name)} is where it "
            "was asked from. Install the same for both."
        )
    return f(*args)

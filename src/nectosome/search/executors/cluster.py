"""Workers of a Dask scheduler as an executor."""

import asyncio
import json
import logging
import os
import pickle
import re
import socket
import time
import warnings
from collections import deque
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Executor, Future
from contextlib import contextmanager
from pathlib import Path
from threading import Lock
from typing import Any

from nectosome.io.extras import package
from nectosome.io.file_system import reason
from nectosome.units import InputError, count

from .spread import check_versions, versions

_PATIENCE = 10.0  # s wait for a scheduler to answer
_ALONE = 30.0  # s between looks whether there are workers
_LOT = 64  # calls that are sent together, below the size of which Dask warns
_TICK = 0.25  # s between those moments at which results are fetched, where many calls wait
_PLAIN = re.compile(r"[\w.-]+:\d+")  # an address without its scheme
_START = "Start some: NPROC=1 dask worker {} --nworkers auto --nthreads 1"


@contextmanager
def cluster(address: str, wait: float = 30.0) -> Iterator[Executor]:
    """Yield an executor whose calls are computed by the workers of a Dask scheduler.

        with cluster("tcp://10.0.0.1:8786") as executor:
            ns.sweep("flagellum", {"omega": "5..25:0.5rad/s"}, executor=executor)

    - address: of the scheduler, such as tcp://10.0.0.1:8786, or its scheduler file (.json).
    - wait: for a first worker [s].

    Warns of workers that compute with more than one thread, and where none is left. Raises InputError where no
    scheduler answers, no worker joins it, and a worker has other versions than this process.
    """
    distributed = package("distributed", "cluster")
    for name in ("distributed", "distributed.client"):  # they tell of each lost connection on stderr
        logging.getLogger(name).setLevel(logging.CRITICAL)
    with _connected(distributed, address) as client:
        try:
            client.wait_for_workers(1, timeout=wait)
        except TimeoutError:
            words = f"no worker has joined {address} within {wait:g} s. {_START.format(_named(address))}"
            raise InputError(words) from None
        _check(client)
        with _watched(client, f"no worker is left at {address}: waiting for one. {_START.format(_named(address))}"):
            yield _Workers(client)


class _Workers(Executor):
    """The workers of a client. Calls go to the scheduler in lots, and as bytes that it need not understand."""

    def __init__(self, client: Any):
        self._client = client
        self._new = deque[tuple[Future[Any], bytes]]()  # not sent yet
        self._sending = Lock()  # held while the client's loop is about to send them
        self._followed = set[asyncio.Task[None]]()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Have a worker compute fn(*args, **kwargs). Raises RuntimeError where the client is closed."""
        if self._client.status == "closed":
            raise RuntimeError("the client is closed")
        from distributed.protocol.pickle import dumps

        future = Future[Any]()
        self._new.append((future, dumps((fn, args, kwargs))))
        if self._sending.acquire(blocking=False):
            self._client.loop.add_callback(self._send)
        return future

    async def _send(self) -> None:
        """Send what is there, in the client's loop."""
        self._sending.release()  # what comes from now on asks for another turn
        while self._new:
            lot = [self._new.popleft() for _ in range(min(len(self._new), _LOT))]
            try:
                sent = self._client.map(_loaded, [call for _, call in lot], pure=False)
            except RuntimeError:  # the client was closed meanwhile
                for future, _ in lot:
                    future.cancel()
                continue
            for (future, _), theirs in zip(lot, sent, strict=True):
                task = asyncio.ensure_future(self._follow(theirs, future))
                self._followed.add(task)
                task.add_done_callback(self._followed.discard)

    async def _follow(self, theirs: Any, future: Future[Any]) -> None:
        """Pass on what becomes of a call."""

        def drop(future: Future[Any]) -> None:
            if future.cancelled():
                theirs.release()

        from distributed.comm.core import CommClosedError

        future.add_done_callback(drop)
        value, error = None, None
        try:
            await theirs.exception()
            if len(self._followed) > _LOT:  # nobody waits for this one
                await asyncio.sleep(_TICK - time.monotonic() % _TICK)
            value = await theirs  # Dask fetches what is asked for at the same time at once
        except (CancelledError, asyncio.CancelledError, CommClosedError):  # or the scheduler went while results came
            future.cancel()
        except Exception as raised:
            error = raised
        if future.set_running_or_notify_cancel():
            future.set_exception(error) if error else future.set_result(value)


@contextmanager
def _watched(client: Any, words: str) -> Iterator[None]:
    """Warn, each time that all workers are gone for a while."""

    async def watch() -> None:
        told = False
        while True:
            await asyncio.sleep(_ALONE)
            none = not (await client.scheduler.identity(n_workers=0))["n_workers"]
            if none and not told:
                warnings.warn(words, stacklevel=2)
            told = none

    watching = asyncio.run_coroutine_threadsafe(watch(), client.loop.asyncio_loop)
    try:
        yield
    finally:
        watching.cancel()


def _loaded(call: bytes) -> Any:
    """What a call gives, in a worker."""
    try:
        f, args, kwargs = pickle.loads(call)
    except (ImportError, AttributeError, TypeError, ValueError) as error:  # of another version
        raise InputError(
            f"the worker on {socket.gethostname()} has nectosome {versions()['nectosome']}, and cannot load what it is "
            f"to compute: {error}. Install the same as here."
        ) from None
    return f(*args, **kwargs)


@contextmanager
def _connected(distributed: Any, given: str) -> Iterator[Any]:
    """A client of the scheduler."""
    given = f"tcp://{given}" if _PLAIN.fullmatch(given) else given
    address = given if "://" in given else _in_file(given)
    try:
        client = distributed.Client(address, timeout=_PATIENCE, set_as_default=False)
    except (OSError, ValueError) as error:  # ValueError: of an address that makes no sense
        why = "" if isinstance(error, OSError) else f" ({' '.join(str(error).split())})"
        raise InputError(f"no scheduler answers at {address}{why}. Is it running: dask scheduler?") from None
    try:
        yield client
    finally:
        client.close(timeout=2)


def _in_file(name: str) -> str:
    """The address in a scheduler file. Raises InputError."""
    try:
        return str(json.loads(Path(name).read_bytes())["address"])
    except OSError as error:
        words = f"is no address of a scheduler, such as tcp://10.0.0.1:8786, nor a scheduler file: {reason(error)}."
        raise InputError(f'"{name}" {words}') from None
    except (ValueError, KeyError, TypeError):
        raise InputError("is no scheduler file: dask scheduler --scheduler-file makes one.", file=name) from None


def _check(client: Any) -> None:
    """Raise InputError for workers of other versions; warn of those that have several threads."""
    theirs = client.get_versions(packages=[*versions()])["workers"]
    for worker, all_ in theirs.items():
        check_versions(all_["packages"], worker)
    threads = [one["nthreads"] for one in client.scheduler_info()["workers"].values()]
    if several := sum(n > 1 for n in threads):
        warnings.warn(
            f"{several} of {count(len(threads), 'worker')} compute with {max(threads)} threads each, which wait for "
            "each other: dask worker --nworkers auto --nthreads 1.",
            stacklevel=4,
        )
    pinned = client.run(os.getenv, "NPROC", on_error="ignore")
    if loose := sum(value is None for value in pinned.values()):
        warnings.warn(
            f"{loose} of {count(len(pinned), 'worker')} run without NPROC=1: linear algebra takes threads for all "
            "processors in each of them.",
            stacklevel=4,
        )


def _named(address: str) -> str:
    return address if "://" in address else f"--scheduler-file {address}"

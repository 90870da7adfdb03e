"""Which machines compute the long work of a tab, this one or a cluster's, and what is kept of work that failed."""

import threading
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from nectosome.search import LostError, cluster

_PATIENCE = 10.0  # s wait for a first worker, in which work cannot be cancelled


class Machines:
    """Those of one tab; `address` is of a cluster, see `nectosome.search.cluster`, None for this machine."""

    def __init__(self, address: str | None):
        self._address = address
        self._lock = threading.Lock()
        self._kept: tuple[str, TemporaryDirectory[str]] | None = None  # what was computed of a request
        self._closed = False

    def named(self, work: str) -> str:
        """What work is called on the page while it is computed here."""
        return work if self._address is None else f"{work} on the cluster"

    @contextmanager
    def executor(self) -> Iterator[Executor | None]:
        """Yield an executor of the cluster, which is looked for anew each time; None for this machine.

        Raises InputError where no cluster answers.
        """
        if self._address is None:
            yield None
            return
        with cluster(self._address, wait=_PATIENCE) as executor:
            yield executor

    @contextmanager
    def kept(self, request: str) -> Iterator[Path]:
        """Yield a folder for what is computed of a request; the last one where that was the same, and failed."""
        with self._lock:
            before, self._kept = self._kept, None
        if before is not None and before[0] != request:
            before[1].cleanup()
            before = None
        folder = TemporaryDirectory(prefix="nectosome-") if before is None else before[1]
        try:
            yield Path(folder.name)
        except BaseException as error:
            with self._lock:
                if not self._closed:
                    self._kept, folder = (request, folder), None
            if isinstance(error, LostError):
                why = str(error) if self._address else "a worker process died, perhaps for want of memory."
                raise LostError(f"{why} Begin it again: it goes on from what was computed.") from None
            raise
        finally:
            if folder is not None:
                folder.cleanup()

    def close(self) -> None:
        """Remove what is kept, for a tab that is closed."""
        with self._lock:
            kept, self._kept, self._closed = self._kept, None, True
        if kept is not None:
            kept[1].cleanup()

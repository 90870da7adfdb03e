"""A thread that works on the newest request only: requests that waited are dropped."""

import threading
from collections.abc import Callable
from typing import Any


class SolverThread:
    """One thread that calls `work(request)` with the newest request, and again whenever there is a newer one."""

    def __init__(self, work: Callable[[Any], None]):
        self._work, self._request, self._closed = work, None, False
        self._news = threading.Condition()
        # no daemon: the interpreter must not end under a program that is being compiled
        threading.Thread(target=self._run, name="studio-solver").start()

    def submit(self, request: Any) -> None:
        """Put a request, which is not None, in place of the one that waits."""
        with self._news:
            self._request = request
            self._news.notify()

    def close(self) -> None:
        """Begin nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._closed or self._request is not None)
                if self._closed:
                    return
                request, self._request = self._request, None
            self._work(request)

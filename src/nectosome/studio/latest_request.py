"""Work on what was asked last: what was asked in between is never begun."""

import threading
from collections.abc import Callable
from typing import Any


class Latest:
    """One thread that calls `work(asked)` with what was asked last, once more whenever something was asked since."""

    def __init__(self, work: Callable[[Any], None]):
        self._work, self._asked, self._closed = work, None, False
        self._news = threading.Condition()
        # no daemon: the interpreter must not end under a program that is being compiled
        threading.Thread(target=self._run, name="studio-solver").start()

    def ask(self, what: Any) -> None:
        """Ask for work on `what`, which is not None, in place of all that waits."""
        with self._news:
            self._asked = what
            self._news.notify()

    def close(self) -> None:
        """Begin nothing more."""
        with self._news:
            self._closed = True
            self._news.notify()

    def _run(self) -> None:
        while True:
            with self._news:
                self._news.wait_for(lambda: self._closed or self._asked is not None)
                if self._closed:
                    return
                asked, self._asked = self._asked, None
            self._work(asked)

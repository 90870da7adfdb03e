"""A device at the other end of a serial line, which may become faulty at any time."""

import os
import select
import threading
import time
import tty
from abc import ABC, abstractmethod
from contextlib import suppress


class OnAPty(ABC):
    """Answers in a thread what it hears on a pseudo terminal, at `path`.

    `silent_from` [s of time.monotonic()] on it says nothing, `late` [s] it answers later, `garbled` it answers with one
    byte changed, `frozen` it does not move any more, and after `pull` the line is cut.
    """

    def __init__(self):
        self.silent_from, self.late, self.garbled, self.frozen = float("inf"), 0.0, False, False
        self._end, self._other = os.openpty()
        os.set_blocking(self._end, False)  # what nobody reads is lost
        tty.setraw(self._other)
        self.path = os.ttyname(self._other)
        self._stopped = threading.Event()
        self._thread = threading.Thread(target=self._run, daemon=True)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *_):
        self.pull()

    def pull(self):
        """Cut the line; may be done again."""
        if not self._stopped.is_set():
            self._stopped.set()
            self._thread.join()
            os.close(self._end)
            os.close(self._other)

    @abstractmethod
    def heard(self, data: bytes) -> bytes:
        """What is answered."""

    def printed(self) -> bytes:
        """What it says by itself."""
        return b""

    @abstractmethod
    def advance(self):
        """Time has passed."""

    @abstractmethod
    def garble(self, answer: bytes) -> bytes:
        """An answer whose checksum is wrong."""

    def _run(self):
        while not self._stopped.is_set():
            ready = select.select([self._end], [], [], 0.005)[0]
            self.advance()
            answer = (self.heard(os.read(self._end, 4096)) if ready else b"") + self.printed()
            if answer and time.monotonic() < self.silent_from:
                if self.late:
                    time.sleep(self.late)
                with suppress(BlockingIOError):
                    os.write(self._end, self.garble(answer) if self.garbled else answer)

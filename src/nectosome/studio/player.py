"""Plays what is on a stage: time goes on while it plays, and stands where the scrubber is put."""

import threading
import time
from collections.abc import Callable

_FRAME = 0.05  # s between pictures


class Player:
    """A clock that shows a picture at every tick. `show(t)` is called in its own thread, and after `seek`."""

    def __init__(self, show: Callable[[float], None]):
        self._show, self._lock = show, threading.Lock()
        self._closed, self._playing = threading.Event(), threading.Event()
        self.time, self.speed = 0.0, 1.0
        self._held = 0.0  # until when nothing is shown, on the clock of `perf_counter` [s]
        threading.Thread(target=self._run, name="studio-player").start()

    @property
    def playing(self) -> bool:
        """Whether time goes on."""
        return self._playing.is_set()

    def play(self, on: bool) -> None:
        """Let time go on, or stop it."""
        (self._playing.set if on else self._playing.clear)()

    def seek(self, t: float) -> None:
        """Show the moment t [s]."""
        with self._lock:
            self.time = t
        self._show(t)

    def hold(self, seconds: float) -> None:
        """Show nothing for so long, while time goes on: an answer that comes soon is drawn sooner. 0 ends it."""
        self._held = time.perf_counter() + seconds

    def close(self) -> None:
        """End the thread."""
        self._closed.set()
        self._playing.set()

    def _run(self) -> None:
        last = time.perf_counter()
        while not self._closed.is_set():
            if not self._playing.is_set():
                self._playing.wait()
                last = time.perf_counter()
                continue
            now = time.perf_counter()
            with self._lock:
                self.time += self.speed * (now - last)
                t = self.time
            last = now
            if now >= self._held:
                self._show(t)
            self._closed.wait(max(0.0, _FRAME - (time.perf_counter() - now)))

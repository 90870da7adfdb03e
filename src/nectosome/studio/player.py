"""Plays what is on a stage: the clock, and the controls that start, stop and set it."""

import threading
import time
from collections.abc import Callable
from typing import Any

import viser

from .work import start_thread

_FRAME = 0.05  # s between pictures
_SPEEDS = (0.05, 0.1, 0.25, 0.5, 1.0, 2.0)


class Player:
    """A clock that shows a picture at every tick. `show(t)` is called in its own thread, and after `seek`."""

    def __init__(self, show: Callable[[float], None]):
        self._show, self._lock = show, threading.Lock()
        self._closed, self._playing = threading.Event(), threading.Event()
        self.time, self.speed = 0.0, 1.0
        self._held = 0.0  # until when nothing is shown, on the clock of `perf_counter` [s]
        start_thread("studio-player", self._run)

    @property
    def playing(self) -> bool:
        """Whether the clock runs."""
        return self._playing.is_set()

    def play(self, on: bool) -> None:
        """Start or stop the clock."""
        (self._playing.set if on else self._playing.clear)()

    def seek(self, t: float) -> None:
        """Set the clock to t [s], and show that instant."""
        with self._lock:
            self.time = t
        self._show(t)

    def hold(self, seconds: float) -> None:
        """Show nothing for so long, while the clock runs: an answer that comes soon is drawn sooner. 0 ends it."""
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


class PlayerControls:
    """A button, a speed and a slider over the time of a run, laid out where this is made."""

    def __init__(self, gui: viser.GuiApi, player: Player):
        self._player = player
        self._button = gui.add_button("Pause")
        self._speed: Any = gui.add_dropdown("Speed", [f"{s:g} x" for s in _SPEEDS], initial_value="1 x")
        self._time: Any = gui.add_slider("Time (s)", 0.0, 1.0, 0.001, 0.0)
        self._button.on_click(lambda _: self.play(not player.playing))
        self._speed.on_update(lambda _: setattr(player, "speed", float(self._speed.value.split()[0])))
        self._time.on_update(self._scrubbed)

    def play(self, on: bool) -> None:
        """Start or stop the clock; the button has the other one's name."""
        self._player.play(on)
        self._button.label = "Pause" if on else "Play"

    def set_end(self, end: float) -> None:
        """Take the end of a run [s]; at 0, without a motion, nothing can be played."""
        self._time.max = round(max(end, 1e-3), 3)
        self._button.disabled = self._time.disabled = end == 0

    def disable(self) -> None:
        """Until there is a motion nothing can be played."""
        self._button.disabled = self._time.disabled = True

    def show(self, t: float) -> None:
        """Let the slider follow the clock."""
        if self._player.playing:
            self._time.value = round(t, 3)

    def _scrubbed(self, event: Any) -> None:
        if event.client is None:  # it moved with the clock
            return
        self.play(False)
        self._player.seek(float(self._time.value))

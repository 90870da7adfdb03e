"""Ctrl-C and similar signals: they interrupt the samples of a run, and wait while a rig is made safe."""

import signal
import threading
from collections.abc import Callable
from typing import Any

# those that end or stop a process unless it says otherwise, closing a terminal and Ctrl-Z included
_NAMES = ("SIGINT", "SIGTERM", "SIGHUP", "SIGBREAK", "SIGTSTP")


class Interrupts:
    """Within it, signals become KeyboardInterrupt in steps that allow them; other signals wait until its end.

    Only the main thread receives signals: in any other one nothing changes. Signals that are ignored stay so.
    """

    def __init__(self):
        self._before: dict[int, Any] = {}
        self._listening = False
        self._held = 0  # a signal that has come and not been raised

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            for number in (getattr(signal, name) for name in _NAMES if hasattr(signal, name)):
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._before[number] = signal.signal(number, self._take)
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before.items():
            signal.signal(number, handler)
        if self._held:
            signal.raise_signal(self._held)

    def allowed(self, step: Callable[[], object]) -> BaseException | None:
        """Take a step that a signal may break off, at once if it has come before; return its error, or None.

        What a signal raises is lost where Python runs something that must not fail, such as a finalizer. The step
        calls `check` again and again, which raises the signal then.
        """
        try:
            try:
                self._listening = True
                self.check()
                step()
                self.check()
            finally:
                self._listening = False
        except BaseException as error:
            if isinstance(error, KeyboardInterrupt):
                self._held = 0
            return error
        return None

    def check(self) -> None:
        """Raise KeyboardInterrupt if a signal has come."""
        if self._held:
            self._listening = False  # no other one until this is caught
            raise KeyboardInterrupt(signal.Signals(self._held).name)

    def _take(self, number: int, _: object) -> None:
        self._held = number
        if self._listening:
            self.check()


def caught(step: Callable[[], object]) -> BaseException | None:
    """Take a step; return its error, or None."""
    try:
        step()
    except BaseException as error:
        return error
    return None

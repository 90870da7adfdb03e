"""What tests of rigs share that need no process of their own."""

import os
import signal
import threading
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from types import SimpleNamespace

import pytest

from nectosome.studio import rig_process


def _process(target, args, name, daemon) -> threading.Thread:
    """A thread in place of a process, with its own end of the pipe, that it closes at its end."""
    theirs, *more = args
    own = Connection(os.dup(theirs.fileno()))

    def run() -> None:
        with own:
            target(own, *more)

    return threading.Thread(target=run, name=name, daemon=daemon)


@pytest.fixture
def in_a_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rig runs in a thread here: a process takes seconds of the processor to import what it needs."""
    beside = SimpleNamespace(Pipe=Pipe, Process=_process)
    monkeypatch.setattr(rig_process, "multiprocessing", SimpleNamespace(get_context=lambda _: beside))
    deaf = SimpleNamespace(signal=lambda *_: None, SIGINT=signal.SIGINT, SIG_IGN=signal.SIG_IGN)  # of the main thread
    monkeypatch.setattr(rig_process, "signal", deaf)

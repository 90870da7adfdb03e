"""Faults, where they are put in, and what is promised of an experiment whatever they are."""

import signal
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from nectosome.io import load_dataset
from nectosome.rigs import laws, log, recovered
from nectosome.units import InputError

from .faulty import RIGS, Faulty, Hook, Setup


def throws(error: BaseException | type[BaseException]) -> Hook:
    def then(*_: Any) -> None:
        raise error

    return then


def gives(value: float) -> Hook:
    return lambda *_: value


def sends(number: int) -> Hook:
    """A real signal, and then what would have been."""

    def then(call: Callable, *arguments: float) -> Any:
        signal.raise_signal(number)
        return call(*arguments)

    return then


def slept(call: Callable, *arguments: float) -> Any:
    """Gives the log's thread a moment: in virtual time there are many samples in one."""
    time.sleep(2e-3)
    return call(*arguments)


@dataclass(frozen=True)
class Fault:
    """From a call of a method on, what it does instead; and how that is to end."""

    method: str  # of the rig; or "step" of the regulator, "append" and "disk" of the log, "progress"
    then: Hook
    ends: Any  # a status, or the exception that comes out
    words: str = ""  # in the reason
    lasting: bool = False
    at_last: str = ""  # the status if it begins at the last sample, where that differs

    def hook(self, position: int) -> Hook:
        def around(n: int, call: Callable, *arguments: Any) -> Any:
            if n == position or (self.lasting and n > position):
                return self.then(call, *arguments)
            return call(*arguments)

        return around


@dataclass
class Courses:
    """Runs an experiment with hooks, and holds what happened to what is promised whatever it is."""

    folder: Path
    monkeypatch: pytest.MonkeyPatch

    def __call__(self, setup: Setup | str, hooks: dict[str, Hook], **changed: Any) -> tuple[Any, Faulty, str]:
        setup = RIGS[setup] if isinstance(setup, str) else setup
        patch(self.monkeypatch, hooks)
        rig = Faulty(setup.rig(), hooks)
        counted = Counted(hooks.get("progress"), lambda share: None)
        before, handlers = set(threading.enumerate()), signals()
        try:
            ended = setup.experiment(rig, **changed).run(self.folder / "run.nc", counted)
        except BaseException as error:
            ended = error
        assert not [thread for thread in set(threading.enumerate()) - before if thread.name == "log"]
        assert signals() == handlers
        safe(rig, setup, clock=not {"now", "wait"} & hooks.keys())
        return ended, rig, reason(ended, self.folder)


class Counted:
    """A function with a hook."""

    def __init__(self, hook: Hook | None, call: Callable, skip: int = 0):
        self.hook, self.call, self.n = hook, call, -skip

    def __call__(self, *arguments: Any) -> Any:
        n, self.n = self.n, self.n + 1
        return self.hook(n, self.call, *arguments) if self.hook else self.call(*arguments)


class CountedRows(Counted):
    """Counts rows of a journal, of which several are written at once."""

    def __call__(self, file: Any, text: str) -> None:
        self.n += sum(not line.startswith("#") for line in text.splitlines()) - 1
        super().__call__(file, text)


def patch(monkeypatch, hooks: dict[str, Hook]) -> None:
    if "step" in hooks:
        wanted = Counted(hooks["step"], laws.ControllerSteps.command)
        monkeypatch.setattr(laws.ControllerSteps, "command", lambda self, measured: wanted(self, measured))
    if "append" in hooks:
        append = Counted(hooks["append"], log.RunLog.append)
        monkeypatch.setattr(log.RunLog, "append", lambda self, *row: append(self, *row))
    for name in ("disk", "journal"):
        if name in hooks:
            monkeypatch.setattr(log, "_write", CountedRows(hooks[name], log._write, skip=1))  # its head
    if "disk" in hooks:
        monkeypatch.setattr(log, "save_dataset", throws(InputError("cannot write: No space left on device.")))


def signals() -> list[Any]:
    return [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGTSTP)]


def safe(rig: Faulty, setup: Setup, clock: bool) -> None:
    """The last thing the device saw is a vent; no command left its range or went too fast, by a clock that is right."""
    whats = [event.what for event in rig.seen]
    assert "vent" in whats
    assert "write" not in whats[whats.index("vent") :]
    assert whats[-1] == "close"
    (limits,), writes = setup.limits.commands.values(), [event for event in rig.seen if event.what == "write"]
    values, times = (np.array([getattr(event, name) for event in writes]) for name in ("value", "time"))
    assert ((limits.low <= values) & (values <= limits.high)).all()
    assert (np.abs(np.diff(values, prepend=0.0)) <= limits.slew * setup.dt * (1 + 1e-9) + 1e-9).all()
    if clock:
        elapsed = np.abs(times[:, None] - times) + setup.jitter
        assert (np.abs(values[:, None] - values) <= limits.slew * elapsed * (1 + 1e-9) + 1e-9).all()


def reason(ended: Any, folder) -> str:
    """What the log says, which is what the caller is told."""
    if (folder / "run.nc").exists():
        told = load_dataset(folder / "run.nc").attrs["status_reason"]
        assert not (folder / "run.csv").exists()
    else:
        told = recovered(folder / "run.csv").attrs["status_reason"]
        if "power failed" in told:  # a full disk takes no reason
            told = ended.reason
    if not isinstance(ended, BaseException):
        assert told in ended.reason
    elif not isinstance(ended, KeyboardInterrupt):
        assert any(told in note for note in ended.__notes__)
    return told

"""Whatever goes wrong at whatever sample: the last thing a device sees is a vent, and a person is told why."""

import errno
import signal
from collections.abc import Callable

import pytest

from nectosome.rigs import RigError

from .faulty import RIGS
from .injected import Courses, Fault, gives, sends, slept, throws

NO_SPACE = OSError(errno.ENOSPC, "No space left on device")
LATE = 0.8 * RIGS["simulated"].dt


class Stuck:
    """Gives again what it gave first."""

    def __init__(self):
        self.value = None

    def __call__(self, call: Callable) -> float:
        self.value = call() if self.value is None else self.value
        return self.value


SAMPLES = {
    "sensor frozen": Fault("measure", None, "aborted", "to the last bit", lasting=True, at_last="finished"),
    "sensor NaN": Fault("measure", gives((float("nan"),)), "aborted", "nan m"),
    "sensor inf": Fault("measure", gives((float("-inf"),)), "aborted", "-inf m"),
    "out of range": Fault("measure", gives((0.0151,)), "aborted", "0.0151 m"),
    "cable pulled": Fault("measure", throws(RigError("laser: no answer.")), "failed", "no answer", lasting=True),
    "write fails": Fault("write", throws(RigError("valve: no answer.")), "failed", "no answer", lasting=True),
    "one write fails": Fault("write", throws(RigError("valve: no answer.")), "failed", "no answer"),
    "wait fails": Fault("wait", throws(RigError("clock: no answer.")), "failed", "no answer", lasting=True),
    "a late sample": Fault("wait", lambda call, until: call(until + LATE), "finished"),
    "late samples": Fault(
        "wait", lambda call, until: call(until + LATE), "aborted", "late", lasting=True, at_last="finished"
    ),
    "valve stuck": Fault("write", lambda call, _: None, "aborted", "error", lasting=True, at_last="finished"),
    "valve open": Fault("write", lambda call, _: call((6e4,)), "aborted", "", lasting=True, at_last="finished"),
    "controller raises": Fault("step", throws(ValueError("singular")), ValueError, "ValueError: singular"),
    "controller NaN": Fault("step", gives(float("nan")), "aborted", "command pressure is nan Pa"),
    "controller inf": Fault("step", gives(float("inf")), "aborted", "command pressure is inf Pa"),
    "Ctrl-C in measure": Fault("measure", throws(KeyboardInterrupt), "interrupted"),
    "Ctrl-C in write": Fault("write", throws(KeyboardInterrupt), "interrupted"),
    "Ctrl-C after write": Fault("write", lambda call, c: (call(c), throws(KeyboardInterrupt)()), "interrupted"),
    "Ctrl-C in wait": Fault("wait", throws(KeyboardInterrupt), "interrupted"),
    "Ctrl-C in step": Fault("step", throws(KeyboardInterrupt), "interrupted"),
    "Ctrl-C in log": Fault("append", throws(KeyboardInterrupt), "interrupted"),
    "SIGINT": Fault("measure", sends(signal.SIGINT), "interrupted", "SIGINT"),
    "SIGTERM": Fault("write", sends(signal.SIGTERM), "interrupted", "SIGTERM"),
    "Ctrl-Z": Fault("wait", sends(signal.SIGTSTP), "interrupted", "SIGTSTP"),
    "terminal closed": Fault("step", sends(signal.SIGHUP), "interrupted", "SIGHUP"),
    "SystemExit in measure": Fault("measure", throws(SystemExit(3)), SystemExit, "SystemExit: 3"),
    "SystemExit in step": Fault("step", throws(SystemExit(3)), SystemExit, "SystemExit: 3"),
    "no memory": Fault("measure", throws(MemoryError), MemoryError, "MemoryError"),
    "progress raises": Fault("progress", throws(BrokenPipeError("stderr")), BrokenPipeError, "stderr"),
    "cancelled": Fault("progress", gives(False), "interrupted", "cancelled"),
    "clock ahead": Fault("now", lambda call: call() + 10.0, "aborted", "late", lasting=True, at_last="finished"),
    "no wait": Fault("wait", lambda *_: None, "aborted", "too early", lasting=True),
    "clock back": Fault("now", lambda call: call() - 10.0, "aborted", "too early", lasting=True),
    "disk full": Fault("disk", throws(NO_SPACE), "failed", "No space left", lasting=True, at_last="failed"),
    "journal broken": Fault("journal", throws(NO_SPACE), "failed", "No space left", lasting=True, at_last="finished"),
}
LAST = RIGS["simulated"].reference.size - 1
POSITIONS = {"first": 0, "middle": 60, "last": LAST}


@pytest.fixture
def course_of(tmp_path, monkeypatch):
    return Courses(tmp_path, monkeypatch)


@pytest.mark.parametrize("kind", RIGS)
@pytest.mark.parametrize("where", POSITIONS)
@pytest.mark.parametrize("name", SAMPLES)
def test_a_fault_during_the_samples(course_of, kind, name, where):
    fault = SAMPLES[name]
    if name == "sensor frozen":
        fault = Fault("measure", Stuck(), fault.ends, fault.words, True, fault.at_last)
    position = POSITIONS[where]
    if fault.method == "now":
        position = max(2 * position, 1)  # asked for the start, then twice a sample
    hooks = {fault.method: fault.hook(position)}
    if fault.method in ("disk", "journal"):
        hooks["wait"] = lambda n, call, *a: slept(call, *a)
    ended, rig, told = course_of(kind, hooks)
    expected = fault.at_last if where == "last" and fault.at_last else fault.ends
    if isinstance(expected, str):
        assert ended.status == expected, told
    else:
        assert type(ended) is expected
    if expected != "finished":
        assert fault.words in told
        if where != "last" and not fault.lasting:
            assert rig.calls.get("measure", 0) <= position + 1  # it ends there
    elif fault.method in ("wait", "now"):
        assert ended.data.attrs["overruns"] >= 1

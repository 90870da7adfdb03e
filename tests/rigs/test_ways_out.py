"""Faults on the way out, on top of others, and at any moment: the rig is made safe, and the first reason is told."""

import os
import random
import signal
import threading
import time
from collections.abc import Callable

import pytest

from nectosome.rigs import RigError

from .faulty import RIGS, Hook, pi
from .injected import Courses, Fault, gives, sends, throws

LAST = RIGS["simulated"].reference.size - 1


@pytest.fixture
def course_of(tmp_path, monkeypatch):
    return Courses(tmp_path, monkeypatch)


def on_the_way(step: int, error: BaseException) -> dict[str, Hook]:
    """Ctrl-C at a sample, and another fault in a write of the ramp."""
    interrupt = Fault("measure", throws(KeyboardInterrupt), "").hook(30)
    return {"measure": interrupt, "write": Fault("write", throws(error), "").hook(30 + step)}


@pytest.mark.parametrize("step", [0, 1, 3])
@pytest.mark.parametrize(
    ("error", "status"),
    [(KeyboardInterrupt(), "interrupted"), (RigError("valve: no answer."), "interrupted"), (SystemExit(2), None)],
)
def test_a_fault_on_the_way_to_0_leads_to_the_vent_at_once(course_of, step, error, status):
    ended, rig, told = course_of("simulated", on_the_way(step, error))
    assert rig.calls["write"] == 30 + step + 1
    assert told.startswith("it was interrupted. On the way to a command of 0: ")
    assert ended.status == status if status else isinstance(ended, SystemExit)


def test_without_a_fault_the_ramp_ends_at_0(course_of):
    _, rig, _ = course_of("simulated", {"measure": Fault("measure", throws(KeyboardInterrupt), "").hook(30)})
    writes = [event.value for event in rig.seen if event.what == "write"]
    assert writes[-1] == 0.0
    assert abs(writes[29]) > 2e4
    assert len(writes) > 30 + abs(writes[29]) / (4e5 * 0.01)


def test_ctrl_c_in_the_ramp_of_a_run_that_has_finished_is_not_lost(course_of):
    ended, _, told = course_of("simulated", {"write": Fault("write", sends(signal.SIGINT), "").hook(LAST + 2)})
    assert ended.status == "interrupted"
    assert told == "On the way to a command of 0: it was interrupted by SIGINT."


@pytest.mark.parametrize("method", ["vent", "close"])
def test_ctrl_c_waits_until_the_rig_is_safe_and_is_told_then(course_of, method):
    """What comes after must not begin as if nobody had said a word."""
    ended, _, _ = course_of("simulated", {method: Fault(method, sends(signal.SIGINT), "").hook(0)})
    assert isinstance(ended, KeyboardInterrupt)


ENDS = {
    "open fails": ("open", throws(RigError("card: not there.")), False, "failed"),
    "open is interrupted": ("open", throws(KeyboardInterrupt), False, "interrupted"),
    "open has a bug": ("open", throws(TypeError("None")), False, TypeError),
    "one vent fails": ("vent", throws(RigError("valve: no answer.")), False, "failed"),
    "all vents fail": ("vent", throws(RigError("valve: no answer.")), True, "failed"),
    "vent has a bug": ("vent", throws(TypeError("None")), True, TypeError),
    "vent is interrupted": ("vent", throws(KeyboardInterrupt), False, "interrupted"),
    "close fails": ("close", throws(RigError("card: busy.")), False, "failed"),
    "close has a bug": ("close", throws(TypeError("None")), False, TypeError),
}


@pytest.mark.parametrize("kind", RIGS)
@pytest.mark.parametrize("name", ENDS)
def test_a_fault_before_the_first_sample_or_after_the_last(course_of, kind, name):
    method, then, lasting, expected = ENDS[name]
    ended, rig, told = course_of(kind, {method: Fault(method, then, "", "", lasting).hook(0)})
    if isinstance(expected, str):
        assert ended.status == expected
    else:
        assert type(ended) is expected
    if method == "vent":
        assert rig.calls["vent"] == 2
        assert ("TAKE ITS POWER OUT BY HAND" in told) == lasting
    if method == "open":
        assert "write" not in rig.calls


@pytest.mark.parametrize("method", ["vent", "close"])
def test_the_first_reason_stays_the_first(course_of, method):
    hooks = {
        "measure": Fault("measure", gives((float("nan"),)), "").hook(30),
        method: Fault(method, throws(RigError("no answer.")), "", "", True).hook(0),
    }
    ended, _, told = course_of("simulated", hooks)
    assert ended.status == "aborted"
    assert told.startswith("at 0.300 s the measurement displacement is nan m.")
    assert "no answer." in told


@pytest.mark.parametrize("gains", [(2e8, 0.0), (2e9, 0.0), (-2e6, -4e7), (2e6, 4e9)])
def test_a_loop_that_swings_or_runs_away_is_stopped(course_of, gains):
    """Commands stay within their range and rate all the time."""
    ended, rig, told = course_of("simulated", {}, controller=pi(*gains))
    assert ended.status == "aborted"
    assert "gains" in told
    assert rig.calls["measure"] < LAST


def test_what_goes_wrong_in_another_thread_is_made_safe_too(course_of):
    """Where there are no signals."""
    found = []
    hooks = {"measure": Fault("measure", throws(RigError("laser: no answer.")), "").hook(5)}
    thread = threading.Thread(target=lambda: found.append(course_of("simulated", hooks)))
    thread.start()
    thread.join()
    assert found[0][0].status == "failed"


@pytest.mark.parametrize("seed", range(8))
def test_signals_at_any_moment_leave_the_rig_safe(course_of, seed):
    """Three of them, from somebody impatient; those that come too late are held back, or find the rig safe."""
    rng = random.Random(seed)
    came = []
    before = signal.signal(signal.SIGINT, lambda *_: came.append(True))

    def impatient() -> None:
        time.sleep(rng.uniform(0.0, 0.15))
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGINT)
            time.sleep(rng.uniform(0.0, 0.01))

    sender = threading.Thread(target=impatient)
    try:
        ended, rig, told = course_of("simulated", {"open": lambda n, call: (call(), sender.start())})
        sender.join()
    finally:
        signal.signal(signal.SIGINT, before)
    assert ended.status == ("interrupted" if "SIGINT" in told else "finished")
    assert rig.calls["close"] == 1


class Deaf:
    """Whose end nothing may disturb: Python drops what is raised in it."""

    def __del__(self):
        signal.raise_signal(signal.SIGINT)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
def test_a_signal_that_python_drops_is_told_with_the_next_sample(course_of):
    def then(call: Callable) -> float:
        Deaf()
        return call()

    ended, rig, _ = course_of("simulated", {"measure": Fault("measure", then, "").hook(30)})
    assert ended.status == "interrupted"
    assert rig.calls["measure"] == 31
    assert [event.value for event in rig.seen if event.what == "write"][-1] == 0.0

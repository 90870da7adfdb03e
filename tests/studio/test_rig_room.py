"""A rig in a process of its own: whatever becomes of the studio and its pages, it is left without power, with a log."""

import os
import signal
import subprocess
import sys
import threading
import time
from functools import partial

import numpy as np
import pytest
from tests.studio.watched_rig import FAILS, commands, events, watched_rig

from nectosome.io import load_dataset
from nectosome.rigs import recovered
from nectosome.studio.rig_process import RigOrder
from nectosome.studio.rig_room import RigRoom
from nectosome.units import InputError

DT, SIZE = 0.02, 1e4  # s, Pa
SHORT, LONG = 60, 30_000  # samples
PROGRAM = """
import sys
from pathlib import Path
from tests.studio.test_rig_room import LONG, ordered
from nectosome.studio.rig_room import RigRoom

if __name__ == "__main__":
    RigRoom().run("tail", ordered(Path(sys.argv[1]), LONG), 600.0, 100, lambda words, share: True)
"""


def ordered(folder, count, fault=""):
    """A sine of half a hertz."""
    signal = SIZE * np.sin(np.pi * DT * np.arange(count))
    make = partial(watched_rig, folder / "seen.txt", fault)
    return RigOrder(make, folder / "run.nc", "sine", {"left.pressure": signal})


def run(folder, count, fault="", room=None, progress=lambda words, share: True):
    return (room or RigRoom()).run("tail", ordered(folder, count, fault), count * DT, 100, progress)


def until(condition):
    end = time.monotonic() + 60
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.02)


def is_safe(folder) -> bool:
    """Whether the last that the device saw took its power out and let it go."""
    return events(folder / "seen.txt")[-2:] == ["vent", "close"]


def ramps_to_zero(folder) -> bool:
    """Whether the commands ended at 0, and none was further from the one before than its rate allows."""
    sent = np.array([0.0, *commands(folder / "seen.txt")])
    return sent[-1] == 0 and np.abs(np.diff(sent)).max() <= 3.8e5 * DT * (1 + 1e-9)


def test_samples_go_on_while_a_page_draws_for_ever(tmp_path):
    """The process that samples waits for nothing here: with a page that hangs all samples are taken, and logged."""
    room, hangs = RigRoom(), threading.Event()
    room.watch(lambda news: news.end is None and hangs.wait(60))
    seen = []
    room.watch(seen.append)
    end = run(tmp_path, SHORT, room=room)
    hangs.set()
    log = load_dataset(tmp_path / "run.nc")
    assert (end.status, end.path) == ("finished", tmp_path / "run.nc")
    assert log.sizes["time"] == SHORT
    np.testing.assert_array_equal(log["left.pressure.command"], commands(tmp_path / "seen.txt")[:SHORT])
    assert is_safe(tmp_path)
    assert ramps_to_zero(tmp_path)
    assert end in [news.end for news in seen]


@pytest.mark.usefixtures("in_a_thread")
def test_watchers_see_the_rows_of_the_log(tmp_path):
    room, seen = RigRoom(), []
    room.watch(seen.append)
    run(tmp_path, SHORT, room=room)
    log = load_dataset(tmp_path / "run.nc")
    assert [news.number for news in seen] == [1] * len(seen)
    last = next(news for news in reversed(seen) if news.end is None)
    column = [*last.units].index("left.displacement")
    assert last.units["left.displacement"] == "m"
    np.testing.assert_array_equal(last.rows[:, column], log["left.displacement"][: len(last.rows)])
    assert len(last.rows) > 10


@pytest.mark.usefixtures("in_a_thread")
def test_stop_works_while_a_page_draws_for_ever(tmp_path):
    room, hangs = RigRoom(), threading.Event()
    room.watch(lambda news: news.end is None and hangs.wait(60))
    ends = []
    thread = threading.Thread(target=lambda: ends.append(run(tmp_path, LONG, room=room)))
    thread.start()
    until(lambda: len(events(tmp_path / "seen.txt")) > 20)
    room.stop()
    until(lambda: is_safe(tmp_path))
    assert not hangs.is_set()
    hangs.set()
    thread.join(60)
    (end,) = ends
    assert (end.status, end.reason) == ("interrupted", "it was cancelled.")
    assert ramps_to_zero(tmp_path)
    assert load_dataset(end.path).attrs["status"] == "interrupted"


@pytest.mark.usefixtures("in_a_thread")
def test_it_ends_when_progress_is_refused(tmp_path):
    end = run(tmp_path, LONG, progress=lambda words, share: not events(tmp_path / "seen.txt"))
    assert end.status == "interrupted"
    assert is_safe(tmp_path)
    assert ramps_to_zero(tmp_path)


@pytest.mark.usefixtures("in_a_thread")
def test_a_pulled_cable_is_told_and_the_rig_is_vented(tmp_path):
    end = run(tmp_path, LONG, "pulled")
    assert end.status == "failed"
    assert FAILS in end.reason
    assert is_safe(tmp_path)
    assert ramps_to_zero(tmp_path)
    log = load_dataset(end.path)
    assert (log.sizes["time"], log.attrs["status_reason"]) == (20, end.reason)


@pytest.mark.usefixtures("in_a_thread")
def test_what_cannot_be_opened_is_an_error_without_a_log(tmp_path):
    room = RigRoom()
    with pytest.raises(InputError, match=r"no such device.*No command was sent"):
        run(tmp_path, LONG, "absent", room)
    assert not [*tmp_path.glob("run.*")]
    room.wait()  # free again


def test_a_process_that_is_killed_is_told_with_what_must_be_done_by_hand(tmp_path):
    end = run(tmp_path, LONG, "killed")
    assert end.status == "failed"
    assert "TAKE ITS POWER OUT BY HAND" in end.reason
    assert "run.csv" in end.reason
    assert recovered(tmp_path / "run.csv").sizes["time"] == 20


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM])
def test_a_rig_outlives_its_studio_to_be_made_safe(tmp_path, number):
    """Killed without a chance to say anything, the studio leaves a pipe that ends."""
    program = tmp_path / "program.py"
    program.write_text(PROGRAM)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    studio = subprocess.Popen([sys.executable, str(program), str(tmp_path)], env=environment)
    try:
        until(lambda: len(events(tmp_path / "seen.txt")) > 20)
    finally:
        studio.send_signal(number)
        studio.wait(60)
    until(lambda: is_safe(tmp_path))
    assert ramps_to_zero(tmp_path)
    until((tmp_path / "run.nc").exists)
    assert load_dataset(tmp_path / "run.nc").attrs["status"] == "interrupted"


def test_one_rig_runs_at_a_time(tmp_path):
    room = RigRoom()
    with room.taken("fin"):
        with pytest.raises(InputError, match="the rig fin is in use"):
            run(tmp_path, SHORT, room=room)
        with pytest.raises(InputError, match="the rig fin is in use"), room.taken("tail"):
            pass
    assert not [*tmp_path.iterdir()]
    with room.taken("tail"):
        pass


@pytest.mark.usefixtures("in_a_thread")
def test_a_log_is_not_overwritten(tmp_path):
    (tmp_path / "run.nc").write_text("measured")
    with pytest.raises(InputError, match="not overwritten"):
        run(tmp_path, SHORT)
    assert (tmp_path / "run.nc").read_text() == "measured"
    assert events(tmp_path / "seen.txt") == []

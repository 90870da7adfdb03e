"""The time left is told once a share is known, and what is being done is told too."""

import re
import time

import pytest

from nectosome.cli import progress
from nectosome.cli.progress import _Work, progress_bar


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes on when it is told to."""
    now = [100.0]
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])

    def wait(seconds: float) -> None:
        now[0] += seconds

    return wait


def test_what_was_compiled_before_the_first_share_does_not_count(clock):
    work = _Work("sweep of eel")
    clock(65)
    assert work.times == "1:05"
    work.update("12 points", 0.1)
    clock(10)
    work.update("12 points", 0.3)  # 0.2 in 10 s: 0.7 takes 35 s
    assert (work.words, work.times) == ("sweep of eel: 12 points", "1:15, about 0:35 left")
    clock(5)
    assert work.times == "1:20, about 0:30 left"
    clock(300)
    assert work.times.endswith("about 0:00 left")
    work.update("12 points", 1.0)
    assert "left" not in work.times


def test_until_there_is_a_second_share_the_speed_is_that_since_the_beginning(clock):
    work = _Work("reproduce")
    clock(60)
    work.update("study 1 of 4", 0.25)
    assert work.times == "1:00, about 3:00 left"


def test_a_share_that_falls_begins_another_part(clock):
    work = _Work("eel")
    clock(10)
    work.update("finding gains", 0.5)
    clock(10)
    work.update("finding gains", 1.0)
    clock(1)
    work.update("detuning", 0.1)
    clock(10)
    work.update("detuning", 0.2)
    assert (work.words, work.times) == ("eel: detuning", "0:31, about 1:20 left")


def test_hours_are_told(clock):
    work = _Work("design")
    clock(3725)
    assert work.times == "1:02:05"


def test_where_stderr_is_no_terminal_there_is_a_line_now_and_then(monkeypatch, capsys):
    monkeypatch.setattr(progress, "_LINE", 0.2)
    with progress_bar("sweep of eel") as update:
        update("12 points", 0.25)
        time.sleep(0.3)
    said = capsys.readouterr()
    assert said.out == ""
    assert re.fullmatch(r"sweep of eel: 12 points \(25 %, 0:00, about 0:\d\d left\)\n", said.err)
    monkeypatch.setattr(progress, "_LINE", 60.0)
    with progress_bar("sweep of eel"):
        time.sleep(0.1)
    assert capsys.readouterr().err == ""

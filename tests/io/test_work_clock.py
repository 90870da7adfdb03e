"""The time left is told once a share is known, and what is being done is told too."""

import pytest

from nectosome.io import work_clock
from nectosome.io.work_clock import WorkClock


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes on when it is told to."""
    now = [100.0]
    monkeypatch.setattr(work_clock.time, "monotonic", lambda: now[0])

    def wait(seconds: float) -> None:
        now[0] += seconds

    return wait


def test_what_was_compiled_before_the_first_share_does_not_count(clock):
    work = WorkClock("sweep of eel")
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
    work = WorkClock("reproduce")
    clock(60)
    work.update("study 1 of 4", 0.25)
    assert work.times == "1:00, about 3:00 left"


def test_a_share_that_falls_begins_another_part(clock):
    work = WorkClock("eel")
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
    work = WorkClock("design")
    clock(3725)
    assert work.times == "1:02:05"

"""Long work of a tab: one at a time, with its progress; it ends by a button, and tells what went wrong."""

import threading
import time
from types import SimpleNamespace

import pytest

from nectosome.studio.work import Work, wait_for_work
from nectosome.units import InputError

CLEARED = ("", False)  # what is said as work begins


class Gui:
    """What `Work` needs of a page."""

    def __init__(self):
        self.press = None

    def add_progress_bar(self, value, visible):
        return SimpleNamespace(value=value, visible=visible)

    def add_html(self, content, visible):
        return SimpleNamespace(content=content, visible=visible)

    def add_button(self, label, visible):
        return SimpleNamespace(visible=visible, on_click=lambda press: setattr(self, "press", press))


@pytest.fixture
def said():
    return []


@pytest.fixture
def gui():
    return Gui()


@pytest.fixture
def work(gui, said):
    return Work(gui, lambda words, bad: said.append((words, bad)))


def ended() -> None:
    for thread in threading.enumerate():
        if thread.name == "studio-work":
            thread.join(20)


def test_a_result_is_handed_on_and_progress_is_seen_meanwhile(work, said):
    seen, results = [], []

    def compute(progress):
        assert progress("a quarter", 0.25)
        seen.append((work._bar.value, work._bar.visible, "a quarter" in work._line.content))
        return 7

    work.begin("counting", compute, results.append)
    ended()
    assert (seen, results, said) == ([(25.0, True, True)], [7], [CLEARED])
    assert not (work._bar.visible or work._line.visible or work._button.visible)


def test_the_button_ends_it_and_what_was_found_is_handed_on(gui, work):
    began, results = threading.Event(), []

    def compute(progress):
        began.set()
        steps = 0
        while progress("", 0.0):
            steps += 1
            time.sleep(0.01)
        return steps

    work.begin("searching", compute, results.append)
    assert began.wait(10)
    with pytest.raises(InputError, match="searching is under way"):
        work.begin("searching more", compute, results.append)
    gui.press(None)
    ended()
    assert len(results) == 1
    work.begin("searching more", lambda progress: progress("", 1.0), results.append)
    ended()
    assert results[-1] is True


def test_the_time_goes_on_while_nothing_new_is_done_and_the_button_says_what_it_does(gui, work, monkeypatch):
    monkeypatch.setattr("nectosome.studio.work._PULSE", 0.01)
    now, end = [100.0], threading.Event()
    monkeypatch.setattr("nectosome.io.work_clock.time", SimpleNamespace(monotonic=lambda: now[0]))

    def compute(progress):
        now[0] += 30.0
        progress("a quarter", 0.25)
        now[0] += 15.0
        return end.wait(10)

    work.begin("counting", compute, lambda _: None, button="Stop")
    until = time.monotonic() + 10
    while "0:45, about 1:15 left" not in work._line.content and time.monotonic() < until:
        time.sleep(0.01)
    assert "counting: a quarter" in work._line.content
    assert "0:45, about 1:15 left" in work._line.content
    assert work._button.label == "Stop"
    end.set()
    ended()


def test_what_was_refused_meanwhile_is_told_to_the_end_of_what_was_under_way(work, said):
    end = threading.Event()
    work.begin("searching", lambda _: end.wait(10), lambda _: None)
    with pytest.raises(InputError, match="searching is under way"):
        work.begin("mapping", lambda _: None, lambda _: None)
    work.cancel()
    with pytest.raises(InputError, match="searching is still ending"):
        work.begin("mapping", lambda _: None, lambda _: None)
    assert said == [CLEARED]
    end.set()
    wait_for_work(20)
    assert said == [CLEARED, CLEARED]


def test_a_double_click_begins_once_and_says_nothing(gui, work, said):
    end, results = threading.Event(), []

    def compute(_):
        return end.wait(10)

    work.begin("searching", compute, results.append)
    work.begin("searching", compute, results.append)
    end.set()
    ended()
    assert (results, said) == ([True], [CLEARED])


def test_the_same_later_is_no_double_click(work, monkeypatch):
    monkeypatch.setattr("nectosome.studio.work._DOUBLE", 0.0)
    end = threading.Event()
    work.begin("searching", lambda _: end.wait(10), lambda _: None)
    with pytest.raises(InputError, match="searching is under way"):
        work.begin("searching", lambda _: None, lambda _: None)
    end.set()
    ended()


@pytest.mark.parametrize(
    ("error", "words"), [(InputError("no such thing."), "no such thing."), (KeyError("x"), "The studio has failed")]
)
def test_what_goes_wrong_is_told_and_the_next_work_can_begin(work, said, error, words, capfd):
    def compute(progress):
        raise error

    results = []
    work.begin("failing", compute, results.append)
    ended()
    cleared, (told, bad) = said
    assert cleared == CLEARED
    assert words in told
    assert bad
    assert ("Traceback" in capfd.readouterr().err) == isinstance(error, KeyError)
    work.begin("next", lambda progress: 1, results.append)
    ended()
    assert results == [1]
    assert said[2:] == [CLEARED]  # what went wrong is no longer told

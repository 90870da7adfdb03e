"""A studio ends in order whenever its program does, and a tab that is closed leaves nothing."""

import gc
import os
import subprocess
import sys
import threading
import time
import weakref

import pytest
from tests.studio.test_markup import ROBOT, NoAnswer
from tests.studio.test_page import ARM
from tests.studio_page import Visitor

from nectosome.description import get_value
from nectosome.studio import session
from nectosome.studio.server import Studio, _forget_closed_tabs

OF_A_TAB = {"studio-player", "studio-solver", "studio-waiting", "studio-work"}
PROGRAM = """
import sys, time
from pathlib import Path
from tests.studio_page import Visitor
from nectosome.studio.server import Studio, _forget_closed_tabs
file, seconds, how = sys.argv[1:]
studio = Studio(file, Path(file).parent, "127.0.0.1", 19_000)
page = Visitor(studio)
end = time.monotonic() + float(seconds)
page.wait(lambda: time.monotonic() > end, 1e3)
if how == "closed":
    studio.close()
if how == "left":
    page.__exit__()
if how == "failed":
    sys.exit(3)
"""


def ended(folder, seconds, how):
    """Exit code and words of a program that ends so long after a tab was opened, while its equations are compiled."""
    (folder / "arm.yaml").write_text(ARM)
    command = [sys.executable, "-c", PROGRAM, str(folder / "arm.yaml"), str(seconds), how]
    environment = {**os.environ, "NECTOSOME_CACHE": str(folder / f"cache{seconds}{how}")}
    done = subprocess.run(command, capture_output=True, text=True, env=environment, timeout=300)
    return done.returncode, done.stdout + done.stderr


def test_a_program_ends_while_its_studio_computes(tmp_path):
    """Its threads were daemons, as those of viser that made them: killed while they compile, they abort the process."""
    assert ended(tmp_path, 0.5, "left alone") == (0, "")


@pytest.mark.slow
@pytest.mark.parametrize("how", ["left alone", "closed", "left", "failed"])
@pytest.mark.parametrize("seconds", [0.0, 0.2, 1.0, 2.0, 4.0, 8.0])
def test_a_program_ends_at_any_time(tmp_path, seconds, how):
    assert ended(tmp_path, seconds, how) == (3 if how == "failed" else 0, "")


def test_tabs_have_a_robot_each(tmp_path, monkeypatch):
    """A slider of one tab moves nothing in another one."""
    monkeypatch.setattr(session, "AnswerSolver", NoAnswer)
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("NAME", "arm"))
    studio = Studio(str(tmp_path / "robot.yaml"), tmp_path, "127.0.0.1", 18_900)
    try:
        with Visitor(studio) as one, Visitor(studio) as other:
            for page in (one, other):
                page.wait(lambda page=page: "no motion of" in page.text and len(studio._sessions) == 2)
            other.write(other.control("k (mN m/rad)")["props"]["label"], 40.0)

            def stiffness():
                return sorted(float(get_value(tab.description, "k")) for tab in studio._sessions.values())

            other.wait(lambda: stiffness() == pytest.approx([0.03, 0.04]))
            other.write(other.control("k (mN m/rad)")["props"]["label"], 900.0)  # typed beside it
            other.wait(lambda: "900 mN m/rad is refused" in other.text)
            assert stiffness() == pytest.approx([0.03, 0.04])
    finally:
        studio.close()


def test_a_tab_that_is_closed_leaves_nothing(tmp_path, monkeypatch):
    """Not even where what it has was set apart from the collection of garbage, as the first answer of a robot does."""
    monkeypatch.setattr(session, "AnswerSolver", NoAnswer)
    before = {*threading.enumerate()}
    (tmp_path / "robot.yaml").write_text(ROBOT.replace("NAME", "arm"))
    studio, tabs = Studio(str(tmp_path / "robot.yaml"), tmp_path, "127.0.0.1", 18_900), weakref.WeakSet()

    def until(condition):
        end = time.monotonic() + 30
        while not condition():
            assert time.monotonic() < end
            time.sleep(0.02)

    try:
        for _ in range(2):
            with Visitor(studio) as page:
                page.wait(lambda page=page: "no motion of" in page.text)
                tabs |= {*studio._sessions.values()}
                gc.freeze()
            until(lambda: not studio._sessions)
        until(lambda: _forget_closed_tabs() or not tabs)  # as the next tab that is closed does
        until(lambda: not {thread.name for thread in {*threading.enumerate()} - before} & OF_A_TAB)
    finally:
        studio.close()

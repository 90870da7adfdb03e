"""Maps, designs and fits of the studio through an executor: told on the page, cancelled, lost, and gone on with."""

import os
import threading
from concurrent.futures import BrokenExecutor, Executor, Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import pytest
from benchmarks.dask_processes import DaskProcesses, kill
from tests.small_robots import DRIVEN
from tests.studio_page import Visitor, nothing_left

from nectosome.description import dump_robot, get_value, parse_robot, with_values
from nectosome.designs.sweep import sweep
from nectosome.io.file_system import entries
from nectosome.studio import session, work
from nectosome.studio.server import Studio
from nectosome.studio.work import STOP

from .test_identify import OSCILLATOR, recording
from .test_markup import NoAnswer, task

ARM = with_values(parse_robot(DRIVEN), {"I": 1e-3, "k": 0.06, "c": 0.01, "M": 0.02, "f": 2.0})
FIN = OSCILLATOR.replace("aliases: {", "aliases: {M: body.joint.torque.amplitude, ")
AXES = {"Axis 1": "M=10,20,30 mN m", "Axis 2": "f=1..2:0.05Hz"}
PROBLEM = "vary: {M: 10..30 mN m, c: 5..20 mN m s/rad}\nminimise: power\nkeep: [power >= 0.15 mW]\n"
UNKNOWN = "k = 25..100 mN m/rad\nc = 3..12 mN m s/rad"
GOES_ON = "Begin it again: it goes on from what was computed."


class Frail(ThreadPoolExecutor):
    """Computes so many calls, one after the other, and breaks at the next one."""

    def __init__(self, calls: int):
        super().__init__(1)
        self.left, self.computed = calls, 0

    def submit(self, fn, /, *args, **kwargs):
        return super().submit(self.call, fn, *args, **kwargs)

    def call(self, fn, *args):
        if not self.left:
            raise BrokenExecutor
        self.left, self.computed = self.left - 1, self.computed + 1
        return fn(*args)


class Silent(Executor):
    """Never computes anything, as a scheduler without workers."""

    def submit(self, fn, /, *args, **kwargs):
        return Future()


@pytest.fixture
def through(monkeypatch):
    """Let an executor stand in for the cluster."""
    chosen = list[Executor]()

    @contextmanager
    def cluster(address, wait):
        assert address == "tcp://somewhere"
        yield chosen[-1]

    monkeypatch.setattr(work, "cluster", cluster)
    chosen.append(Silent())
    return chosen.append


@contextmanager
def page_of(folder, monkeypatch, robot, cluster="tcp://somewhere"):
    """A tab of a studio with a cluster, whose robot is not answered for, as it is seen and as it is inside."""
    monkeypatch.setattr(session, "AnswerSolver", NoAnswer)
    (folder / "arm.yaml").write_text(robot)
    (folder / "arm.design.yaml").write_text(PROBLEM)
    studio = Studio(str(folder / "arm.yaml"), folder, "127.0.0.1", 19_200, cluster)
    try:
        with Visitor(studio) as page:
            page.wait(lambda: "no motion of" in page.text and studio._sessions)  # its first words come while it is made
            (tab,) = studio._sessions.values()
            yield page, tab
    finally:
        studio.close()
        assert nothing_left()


def working() -> bool:
    return any(thread.name == "studio-work" for thread in threading.enumerate())


def begin(page, button: str, words: str) -> None:
    """Press a button once the last work has ended, and see words that come of it."""
    page.wait(lambda: not working())
    page.text = ""
    page.press(button)
    page.wait(lambda: words in page.text, 60.0)


def mapped(page, tab):
    """Map that is made in the end."""
    begin(page, "Compute map", "map on the cluster")
    page.wait(lambda: task(tab, "Map")._found is not None, 60.0)
    return task(tab, "Map")._found


def test_a_map_that_is_lost_goes_on(tmp_path, monkeypatch, through):
    with page_of(tmp_path, monkeypatch, dump_robot(ARM)) as (page, tab):
        for label, text in AXES.items():
            page.write(label, text)
        first, second = Frail(2), Frail(9)
        through(first)
        begin(page, "Compute map", f"perhaps for want of memory. {GOES_ON}")
        assert "map on the cluster: 63 points" in page.text
        assert first.computed == 2
        through(second)
        found = mapped(page, tab)
        assert second.computed == 1  # of 3 parts
    here = sweep(ARM, {"M": [0.01, 0.02, 0.03], "f": "1..2:0.05Hz"}, workers=1)
    assert found.drop_attrs().identical(here.drop_attrs())


def test_a_search_that_is_lost_goes_on(tmp_path, monkeypatch, through):
    with page_of(tmp_path, monkeypatch, dump_robot(ARM)) as (page, tab):
        page.write("Starts", 1)
        whole, first, second = Frail(500), Frail(3), Frail(500)
        through(whole)
        begin(page, "Start search", "evaluations, ended")
        expected = task(tab, "Design")._found
        through(first)
        begin(page, "Start search", GOES_ON)
        assert "search on the cluster" in page.text
        through(second)
        begin(page, "Start search", "evaluations, ended")
        found = task(tab, "Design")._found
        assert get_value(tab.description, "M") == pytest.approx(0.02)
        page.press("Apply best")
        best = found.task.robot_at(found.best[0][1].u)
        page.wait(lambda: get_value(tab.description, "M") == pytest.approx(get_value(best, "M"), abs=1e-4))
        assert [e.objective for e in found.starts[0]] == [e.objective for e in expected.starts[0]]
        assert first.computed + second.computed == whole.computed > 5
        assert first.computed == 3


def test_what_is_kept_is_of_the_same_request_and_ends_with_its_tab(through):
    ours = work.Machines("tcp://somewhere")

    def lost(request: str):
        with pytest.raises(ZeroDivisionError), ours.kept(request) as folder:
            (folder / request).touch()
            raise ZeroDivisionError
        return folder

    first, again, other = lost("a"), lost("a"), lost("b")
    assert first == again != other
    assert not first.exists()
    with ours.kept("b") as folder:
        assert entries(folder, "*") == [folder / "b"]
    assert not folder.exists()
    last = lost("c")
    ours.close()
    assert not last.exists()
    assert not lost("d").exists()


def test_fits_are_made_by_the_cluster(tmp_path, monkeypatch, through):
    (tmp_path / "good.csv").write_text(recording())
    with page_of(tmp_path, monkeypatch, FIN) as (page, tab):
        identify = task(tab, "Identify")
        identify._take(tmp_path / "good.csv", "good.csv")
        page.write("Unknown", UNKNOWN)
        page.write("Starts", 2)
        first, second = Frail(1), Frail(2)
        through(first)
        begin(page, "Identify", "a worker process died")
        assert "identifying on the cluster" in page.text
        through(second)
        begin(page, "Identify", "studio-fit")
        assert second.computed == 2
        assert "2 of 2 starts came to these values" in page.text


def test_work_is_cancelled_where_no_worker_ends_it(tmp_path, monkeypatch, through):
    (tmp_path / "good.csv").write_text(recording())
    through(Silent())
    with page_of(tmp_path, monkeypatch, FIN) as (page, tab):
        task(tab, "Identify")._take(tmp_path / "good.csv", "good.csv")
        page.write("Unknown", UNKNOWN)
        said = {"Compute map": " points<div", "Start search": ": 0 evaluations", "Identify": ": fitting"}
        for button, words in said.items():
            begin(page, button, " on the cluster")
            page.wait(lambda words=words: words in page.text)  # calls wait in the executor
            page.press("Cancel" if button == "Compute map" else STOP)
            page.wait(lambda: not working())
        page.wait(lambda: "stopped before its first step" in page.text)


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="processes are killed the POSIX way")
def test_a_scheduler_that_dies_ends_its_map_and_another_one_goes_on(tmp_path, monkeypatch):
    pytest.importorskip("distributed")
    with (
        DaskProcesses(tmp_path) as dask,
        page_of(tmp_path, monkeypatch, dump_robot(ARM), _with_workers(dask)) as (page, tab),
    ):
        page.write("Axis 1", "M=10..30:0.5mN m")
        page.write("Axis 2", "f=1..3:0.05Hz")
        page.press("Compute map")
        page.wait(lambda: tab.work._bar.value > 10, 120)
        kill(dask.scheduler)
        page.wait(lambda: f"the connection to the scheduler was lost. {GOES_ON}" in page.text, 60)
        begin(page, "Compute map", "no scheduler answers")
        kept = len(entries(Path(tab.machines._kept[1].name), "*.npz"))
        assert kept > 5
        dask.restart()
        dask.add(2)
        dask.wait()
        found = mapped(page, tab)
    here = sweep(ARM, {"M": "10..30:0.5mN m", "f": "1..3:0.05Hz"})
    assert found.drop_attrs().identical(here.drop_attrs())


def _with_workers(dask: DaskProcesses) -> str:
    dask.add(2)
    dask.wait()
    return dask.address

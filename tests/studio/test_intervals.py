"""The studio's tab of intervals: those of `spread`, with their causes, kept as files; a robot without a motion."""

from types import SimpleNamespace

import pytest
from tests.small_robots import DRIVEN, K

from nectosome.designs.uncertain_runs import spread
from nectosome.io import load_dataset
from nectosome.io.tables import number

from .test_machines import begin, page_of
from .test_markup import task

HINGE = DRIVEN.replace(f"stiffness: {K} N m/rad", f"stiffness: {K} +- {0.1 * K} N m/rad")


def test_intervals_are_those_of_spread(tmp_path, monkeypatch):
    with page_of(tmp_path, monkeypatch, HINGE, cluster=None) as (page, tab):
        begin(page, "Compute intervals", "there is no lasting motion yet")
        tab.answer = SimpleNamespace(kind="periodic motion")
        page.write("Draws", 8)
        page.press("Compute intervals")
        page.wait(lambda: task(tab, "Intervals")._found is not None, 60.0)
        page.wait(lambda: "studio-intervals" in page.text)
        expected = spread(tab.description, "periodic", draws=8)
        assert expected is not None and expected.main is not None
        k = expected.main
        low, high = map(number, expected.ends[:, k])
        assert f", {low} to {high}</div>" in page.text
        for label, name in (("Save draws (.nc)", "intervals.nc"), ("Save page (.html)", "intervals.html")):
            page.press(label)
            page.wait(lambda name=name: f"saved {name}" in page.text)
        assert "<table" in (tmp_path / "intervals.html").read_text()
        tab.open(tmp_path / "arm.yaml")  # nothing waits for what it holds itself
        assert task(tab, "Intervals")._found is None
        kept = load_dataset(tmp_path / "intervals.nc")
        assert kept["low"].values == pytest.approx(expected.ends[0], nan_ok=True)


def test_draws_that_were_cancelled_go_on(tmp_path, monkeypatch):
    asked = []

    def some(robot, verb, folder, **options):
        asked.append([*folder.iterdir()])
        (folder / "part").write_text("")

    monkeypatch.setattr("nectosome.studio.tasks.motion_intervals.spread", some)
    with page_of(tmp_path, monkeypatch, HINGE, cluster=None) as (page, tab):
        tab.answer = SimpleNamespace(kind="periodic motion")
        for kept in (0, 1):
            begin(page, "Compute intervals", "they go on from the draws that were computed")
            assert len(asked[-1]) == kept

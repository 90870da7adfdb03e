"""Scenes of a report: one for each run that carries its robot, in a page that they share."""

import base64
import re

import pytest

from nectosome.io import dump_robot
from nectosome.robots import describe
from nectosome.view import scenes, write_report
from nectosome.view.scenes import Scenes

from .conftest import made_up_run


@pytest.fixture(scope="module")
def runs():
    robot = dump_robot(describe("flagellum"))
    return {"swims": made_up_run(robot=robot), "drifts": made_up_run(0.1, robot=robot), "bare": made_up_run()}


def test_each_run_with_a_robot_has_its_button_and_data(runs):
    made = Scenes()
    figure = made.figure(runs, "study")
    assert re.findall(r'<button value="([^"]*)"[^>]*>([^<]*)<', figure) == [
        ("study-scene-1", "swims"),
        ("study-scene-2", "drifts"),
    ]
    data = re.findall(r'<script type="text/plain" id="study-scene-\d">([^<]*)</script>', figure)
    assert len(data) == 2 and data[0] != data[1]
    for each in data:
        assert len(base64.b64decode(each, validate=True)) > 1000
    head = made.head()
    assert head.count("<script") == head.count("</script") == 1  # nothing of the shared page ends it before


def test_a_report_holds_what_they_share_once(runs, study, tmp_path):
    study.runs.update(runs)
    write_report([study], tmp_path / "report.html")
    page = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert page.count("const scenePage") == 1
    assert page.count('<script type="text/plain"') == 2
    assert page.count("window.__VISER_EMBED_DATA__") == 1


def test_there_are_none_without_robots_or_without_their_package(runs, monkeypatch):
    made = Scenes()
    assert made.figure({"bare": runs["bare"]}, "study") == made.head() == ""
    monkeypatch.setattr(scenes, "find_spec", lambda name: None)
    assert made.figure(runs, "study") == made.head() == ""

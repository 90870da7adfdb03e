"""Scenes of a report: one for each run that carries its robot, in a page that they share."""

import base64
import re
from io import BytesIO

import imageio.v3 as imageio
import pytest
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, chromium

from nectosome.description import dump_robot
from nectosome.papers.report import write_report
from nectosome.robots import describe
from nectosome.view import offline_scenes as scenes
from nectosome.view.offline_scenes import Scenes

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


@NEEDS_CHROMIUM
def test_the_first_plays_where_it_comes_into_view_and_another_where_it_is_chosen(runs, study, tmp_path):
    study.runs.update(runs)
    write_report([study], tmp_path / "report.html")
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 900, "height": 800})
        page.set_default_timeout(PATIENCE)
        page.goto((tmp_path / "report.html").as_uri())
        frame = page.locator(".scenes iframe")
        assert frame.get_attribute("srcdoc") is None
        frame.scroll_into_view_if_needed()
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        first = frame.get_attribute("srcdoc")
        assert page.inner_text(".scenes .on") == "swims"
        page.get_by_role("button", name="drifts").click()
        assert page.inner_text(".scenes .on") == "drifts"
        assert frame.get_attribute("srcdoc") not in (None, first)
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        page.wait_for_timeout(4000)
        shot = frame.screenshot()
        (tmp_path / "scene.png").write_bytes(shot)
        pixels = imageio.imread(BytesIO(shot), extension=".png")[..., :3].astype(int)
        assert (pixels.max(axis=-1) - pixels.min(axis=-1) > 60).any()  # the rod is blue, all around it is grey

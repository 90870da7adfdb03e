"""Scenes that turn and play in a page: of a run, of each run of a study, of robots side by side."""

import threading
from io import BytesIO

import imageio.v3 as imageio
import numpy as np
import pytest
from tests.made_up_runs import made_up_run, unpacked
from tests.studio_page import NEEDS_CHROMIUM, PATIENCE, chromium

from nectosome.description import dump_robot
from nectosome.robots import describe
from nectosome.view import scenes, show_run, show_still
from nectosome.view.display.bodies import bodies_of
from nectosome.view.page import write_page
from nectosome.view.scenes import Actor, last_periods, picture_interval, run_scene, side_by_side
from nectosome.view.style import Panel
from nectosome.view.tubes import description


@pytest.fixture(scope="module")
def runs():
    robot = dump_robot(describe("flagellum"))
    return {"swims": made_up_run(robot=robot), "drifts": made_up_run(0.1, robot=robot), "bare": made_up_run()}


def test_each_run_of_a_study_with_a_robot_has_a_scene(runs):
    found = last_periods(runs)
    assert found is not None and [*found.recordings] == ["swims", "drifts"]
    first, second = (unpacked(recording) for recording in found.recordings.values())
    assert first != second
    for name in (b"/world/filament", b"/world/body", b"/around/ground", b"SetCameraPositionMessage"):
        assert name in first
    assert last_periods({"bare": runs["bare"]}) is None


def test_a_scene_needs_no_server(runs):
    """Neither a port nor a thread: nobody can come in while it is recorded."""
    before = threading.active_count()
    run_scene(runs["swims"])
    assert threading.active_count() == before


def test_a_run_that_nobody_knows_the_robot_of_has_a_scene(runs):
    assert b"/world/filament" in unpacked(run_scene(runs["bare"].drop_attrs()).recordings[""])


def test_a_long_run_has_fewer_pictures_a_second():
    assert picture_interval(np.linspace(0, 10, 1001)) == pytest.approx(0.05)
    assert picture_interval(np.linspace(0, 10, 11)) == pytest.approx(1.0)  # as it was saved
    assert picture_interval(np.linspace(0, 1200, 100_001)) == pytest.approx(1200 / 599)


def test_robots_side_by_side_have_equal_scales_stay_in_place_and_apart(runs, monkeypatch):
    put = []
    monkeypatch.setattr("nectosome.view.display.offline.recording", lambda fill, camera: put.append(fill) or "")
    run = runs["swims"]
    times = np.linspace(0.2, 0.8, 7)
    actors = [Actor(run, times, label) for label in "abcd"]
    assert side_by_side(actors, 3.0, columns=2).recordings == {"": ""}

    class Seen:
        def __init__(self):
            self.labels = {}

        def put(self, playback, bodies, arrows, water, look):
            self.playback, self.bodies = playback, bodies

        def write(self, name, words, place):
            self.labels[words] = place

    stage = Seen()
    put[0](stage)
    assert stage.playback.time[-1] == 3.0 and len(stage.playback.time) == 7
    assert [*stage.labels] == [*"abcd"]
    alone = bodies_of(run, description(run))
    boxes = []
    for k in range(4):
        own = [body for name, body in stage.bodies.items() if name.startswith(f"{k}-")]
        assert len(own) == len(alone)
        np.testing.assert_allclose(np.ptp(stage.bodies[f"{k}-body"].place, axis=0), 0, atol=1e-12)
        corners = np.concatenate([body.corners(t) for body in own for t in range(7)])
        boxes.append((corners.min(axis=0), corners.max(axis=0)))
        assert stage.labels["abcd"[k]][2] > boxes[-1][1][2]
    size = np.ptp(boxes[0], axis=0)
    for low, high in boxes[1:]:
        np.testing.assert_allclose(high - low, size, rtol=1e-9)  # the same robot, equally large
    assert boxes[0][1][0] < boxes[1][0][0] and boxes[2][1][0] < boxes[3][0][0]  # beside each other
    assert boxes[2][1][2] < boxes[0][0][2] and boxes[3][1][2] < boxes[1][0][2]  # under each other
    recorded = scenes.side_by_side  # all of it is recorded, too
    monkeypatch.undo()
    assert b"LabelMessage" in unpacked(recorded(actors, 3.0).recordings[""])


def test_a_page_without_plots_does_not_carry_the_plotting_library(runs, tmp_path):
    show_still(runs["swims"], tmp_path / "still.html", [])
    page = (tmp_path / "still.html").read_text(encoding="utf-8")
    assert "plotly.js v" not in page and page.count("const scenePage") == 1 and len(page) < 2e6


@NEEDS_CHROMIUM
def test_the_first_plays_where_it_comes_into_view_and_another_where_it_is_chosen(runs, tmp_path):
    shown = Panel("Scenes", "Two.", last_periods(runs) or "")
    write_page(tmp_path / "report.html", "Runs", ['<p style="height: 2000px">Above.</p>', shown])
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 900, "height": 800})
        page.set_default_timeout(PATIENCE)
        page.goto((tmp_path / "report.html").as_uri())
        box = page.locator(".scenes")
        frame = box.locator("iframe")
        assert frame.get_attribute("srcdoc") is None
        frame.scroll_into_view_if_needed()
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        first = frame.get_attribute("srcdoc")
        assert box.locator(".on").inner_text() == "swims"
        page.get_by_role("button", name="drifts").click()
        assert box.locator(".on").inner_text() == "drifts"
        assert frame.get_attribute("srcdoc") not in (None, first)
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        page.wait_for_timeout(4000)
        shot = frame.screenshot()
        (tmp_path / "scene.png").write_bytes(shot)
        pixels = imageio.imread(BytesIO(shot), extension=".png")[..., :3].astype(int)
        assert (pixels.max(axis=-1) - pixels.min(axis=-1) > 60).any()  # the rod is blue, all around it is grey


@NEEDS_CHROMIUM
def test_a_scene_out_of_view_is_put_away_and_comes_back(runs, tmp_path):
    show_run(runs["swims"], tmp_path / "run.html")
    with chromium() as browser:
        page = browser.new_page(viewport={"width": 900, "height": 500})
        page.set_default_timeout(PATIENCE)
        page.goto((tmp_path / "run.html").as_uri())
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()
        frame = page.locator(".scenes iframe")
        page.evaluate("scrollTo(0, document.body.scrollHeight)")
        page.wait_for_function("!document.querySelector('.scenes iframe').hasAttribute('srcdoc')")
        frame.scroll_into_view_if_needed()
        page.frame_locator(".scenes iframe").locator("canvas").first.wait_for()

"""The stage in the browser: what comes on it in place of something else is where it should be, in its colours."""

import numpy as np
import pytest
import viser
from viser import _messages as messages

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.view.display.bodies import linear
from nectosome.view.display.offline import player_page, recording
from nectosome.view.display.scene_graph import CAMERAS, Look, Stage
from nectosome.view.still import standing

MOVING = """
name: moving
water: {{gravity: 0 m/s2{surface}}}
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 20 mm
  height: 60 mm
  mass: 1 kg
  volume: 0 m3
  joint: {{kind: prismatic, axis: x, motion: {{kind: rate, rate: 3 m/s}}}}
  loads: {{drag: {{kind: lumped_drag, drag_area: [2 cm2, 0 m2, 0 m2]}}}}
"""
RESTING = """
name: resting
water: {gravity: 0 m/s2}
body:
  {kind: rigid, shape: box, length: 50 mm, width: 20 mm, height: 20 mm, mass: 1 kg, volume: 0 m3, joint: {kind: free}}
"""


class Browser:
    """Poses as a browser has them, which keeps that of what is removed and comes back at once."""

    def __init__(self, scene):
        self.position, self._there, queue = {}, set(), scene._queue_scene_message
        scene._queue_scene_message = lambda message: (self._hear(message), queue(message))[1]

    def _hear(self, message):
        name = getattr(message, "name", None)
        if isinstance(message, messages.SetPositionMessage):
            self.position[name] = message.position
        elif isinstance(message, messages.RemoveSceneNodeMessage):
            self._there.discard(name)
        elif isinstance(message, messages._CreateSceneNodeMessage):
            self._there.add(name)

    def seen(self):
        return {name: self.position.get(name, (0.0, 0.0, 0.0)) for name in self._there}


@pytest.fixture
def stage():
    server = viser.ViserServer(port=18_750, verbose=False)
    browser = Browser(server.scene)
    made = Stage(server.scene)
    yield made, browser
    server.stop()


@pytest.mark.parametrize("surface", ["", ", surface: 1 m"])
def test_the_next_robot_stands_where_it_is_and_nothing_of_the_last_one_is_left(stage, surface):
    made, browser = stage
    moving, resting = parse_robot(MOVING.format(surface=surface)), parse_robot(RESTING)
    run = simulate(build(moving), 0.5, samples=5).to_dataset()
    made.load(run, moving, 0.0, Look(forces=True))
    made.at(0.5)
    away = np.abs(list(browser.seen().values())).max()
    assert away > 1.5  # as it has gone so far
    made.load(standing(resting, build(resting)), resting, 0.0, Look(along=False))
    made.at(0.0)
    seen = browser.seen()
    assert {name for name in seen if name.count("/") == 2} == {"/world/body", "/around/ground"}
    for name, node in made._nodes.items():
        np.testing.assert_allclose(seen[name], node.position, atol=1e-12, err_msg=name)
        assert np.abs(node.position).max() < 0.5


def test_colours_of_many_things_are_told_as_light():
    """sRGB 188 is half of the light of 255; the ends stay."""
    assert linear(np.array([[0, 188, 255]])).tolist() == [[0, 128, 255]]


def test_what_goes_on_is_looked_at_where_it_is(stage):
    made, _ = stage
    moving = parse_robot(MOVING.format(surface=""))
    run = simulate(build(moving), 0.5, samples=5).to_dataset()
    made.load(run.isel(time=slice(0, 1)), moving, 0.0, Look())
    there = made.camera("side")
    made.load(run, moving, 0.0, Look())
    made.go_on(run.isel(time=slice(4, 5)), moving, run["position"].values[:, 0])
    np.testing.assert_allclose(made.camera("side"), there, atol=1e-9)  # of one who goes along


@pytest.mark.parametrize("aspect", [0.4, 1.0, 2.5])
@pytest.mark.parametrize("name", CAMERAS)
def test_all_of_a_robot_is_seen_however_narrow_the_page(stage, name, aspect):
    """Its corners lie within the picture; viser's camera sees 75 deg from top to bottom."""
    made, _ = stage
    robot = parse_robot(RESTING)
    made.load(standing(robot, build(robot)), robot, 0.0, Look())
    place, target = made.camera(name, aspect)
    ahead = (target - place) / np.linalg.norm(target - place)
    right = np.cross(ahead, (0, 0, 1)) / np.linalg.norm(np.cross(ahead, (0, 0, 1)))
    corners = made._corners(0) - place
    x, y = (corners @ axis / (corners @ ahead) for axis in (right, np.cross(right, ahead)))
    high = np.tan(np.radians(75 / 2))
    assert np.abs(y).max() < high
    assert np.abs(x).max() < aspect * high
    assert max(np.abs(y).max() / high, np.abs(x).max() / (aspect * high)) > 0.15  # nor is it too small


def test_viser_still_takes_a_recorder_for_a_client():
    """What it asks of one is not promised: where it asks for more, this says of which name and since which version."""
    robot = parse_robot(RESTING)
    known = f"known to do so is viser 1.1.1, this is viser {viser.__version__}"
    try:
        assert recording(lambda stage: stage.load(standing(robot, build(robot)), robot, 0.0, Look()))
        assert player_page()
    except (AttributeError, TypeError, ValueError) as error:
        pytest.fail(f"viser takes no recorder of ours ({error}): {known}")

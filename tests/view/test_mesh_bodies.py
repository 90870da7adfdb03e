"""Parts that are meshes: on pages as bodies with edges where they have some, in pictures as their faces."""

import numpy as np
import pytest
import trimesh

from nectosome.description import load_robot
from nectosome.geometry import Triangles, creased
from nectosome.model import build
from nectosome.view.display.bodies import bodies_of
from nectosome.view.drawing import Scene, _pieces
from nectosome.view.still import standing
from nectosome.view.tubes import tubes

ROBOT = """
name: hull
body:
  kind: rigid
  shape: {mesh: hull.stl, unit: mm}
  density: 1000 kg/m3
  rotation: [0 deg, 0 deg, 90 deg]
  offset: [1 m, 0 m, 0 m]
  joint: {kind: free}
limbs:
  arm: {kind: rigid, shape: cylinder, length: 50 mm, radius: 5 mm, mass: 1 g, offset: [300 mm, 0 mm, 0 mm]}
"""


@pytest.fixture
def run(tmp_path):
    mesh = trimesh.creation.box((300.0, 40.0, 50.0)).apply_translation([150, 0, 10])
    mesh.export(tmp_path / "hull.stl")
    (tmp_path / "hull.yaml").write_text(ROBOT)
    robot = load_robot(tmp_path / "hull.yaml")
    return robot, standing(robot, build(robot))


def test_a_mesh_is_drawn_where_it_is(run):
    """Turned by 90 degrees about z: its x axis along the world's y."""
    robot, standing_run = run
    low, high = [0.98, 0, -0.015], [1.02, 0.3, 0.035]
    corners = bodies_of(standing_run, robot)["body"].corners(0)
    faces = tubes(standing_run, np.zeros(1))["body"][0]
    assert faces.shape == (12, 3, 3)
    for points in (corners, faces.reshape(-1, 3)):
        assert points.min(axis=0) == pytest.approx(low, abs=2e-5)
        assert points.max(axis=0) == pytest.approx(high, abs=2e-5)


def test_edges_of_a_mesh_are_sharp_and_round_parts_smooth():
    box, ball = trimesh.creation.box((1.0, 1, 1)), trimesh.creation.icosphere(2)
    apart = creased(Triangles(np.array(box.vertices), np.array(box.faces)))
    assert len(apart.vertices) == 24
    assert apart.solid.size == pytest.approx(1, rel=1e-12)
    assert len(creased(Triangles(np.array(ball.vertices), np.array(ball.faces))).vertices) == len(ball.vertices)


def test_faces_of_a_picture_cover_the_triangles_and_turn_as_they_do():
    corners = trimesh.creation.icosphere(1).triangles
    pieces = (_pieces(corners, 200.0) @ corners[:, None]).reshape(-1, 4, 3)
    assert len(pieces) > 4 * len(corners)
    area = 0.5 * np.cross(pieces[:, 2] - pieces[:, 0], pieces[:, 3] - pieces[:, 1])
    whole = 0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    assert np.linalg.norm(area, axis=1).sum() == pytest.approx(np.linalg.norm(whole, axis=1).sum(), rel=1e-9)
    assert (np.sum(area * pieces.mean(axis=1), axis=1) > 0).all()


def test_a_picture_shows_the_mesh(run):
    _, standing_run = run
    text = Scene(standing_run, 0.0, (320, 200), "three-quarter").svg(0.0)
    assert text.count("<poly") + text.count("<path") > 100

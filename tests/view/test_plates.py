"""Plates by their outlines as they are drawn: where their corners are, in a page's scene and in pictures."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.view.display.bodies import RigidMesh, bodies_of
from nectosome.view.still import standing
from nectosome.view.tubes import tubes

CORNERS = np.array([[0, -10], [60, -20], [45, 0], [60, 30], [0, 10]])  # forked, mm
FIN = f"""
name: fin
body:
  kind: rigid
  shape: {{outline: {[[f"{x} mm", f"{y} mm"] for x, y in CORNERS.tolist()]}, thickness: 2 mm, plane: PLANE}}
  density: 1100 kg/m3
  offset: [0.3 m, 0.1 m, 0 m]
  rotation: [20 deg, -10 deg, 30 deg]
  joint: {{kind: free}}
"""


@pytest.mark.parametrize(("plane", "axes"), [("xy", (0, 1, 2)), ("xz", (0, 2, 1))])
def test_a_plate_is_drawn_by_its_corners_where_they_are_in_the_world(plane: str, axes: tuple[int, ...]):
    robot = parse_robot(FIN.replace("PLANE", plane))
    run = standing(robot, build(robot))
    corners = np.zeros((10, 3))
    corners[:, axes[:2]] = np.tile(CORNERS, (2, 1))
    corners[:, axes[2]] = np.repeat([-1, 1], 5)
    R = Rotation.from_euler("xyz", [20, -10, 30], degrees=True)
    expected = R.apply(1e-3 * corners) + np.array([0.3, 0.1, 0])
    body = bodies_of(run, robot)["body"]
    assert isinstance(body, RigidMesh)
    (faces,) = tubes(run, np.zeros(1))["body"]
    for drawn in (body.corners(0), faces.reshape(-1, 3)):
        away = np.linalg.norm(drawn[:, None] - expected, axis=-1)
        assert away.min(axis=0).max() < 1e-12  # each corner is there
        low, high = expected.min(axis=0) - 1e-12, expected.max(axis=0) + 1e-12
        assert ((drawn >= low) & (drawn <= high)).all()
    a, b, c = body.corners(0)[body.faces].swapaxes(0, 1)
    volume = np.sum(np.cross(b, c) * a) / 6  # outward faces
    x, y = 1e-3 * CORNERS.T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    assert volume == pytest.approx(0.002 * area, rel=1e-12)

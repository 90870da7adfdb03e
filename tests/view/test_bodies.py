"""A run as bodies for the stage: where they are, how long they are, how they are bent and pushed."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.view.display.bodies import (
    AROUND,
    RigidMesh,
    Soft,
    arrows_of,
    bodies_of,
    colours,
    disc_mesh,
    slice_mesh,
)
from nectosome.view.still import standing

LENGTH, RADIUS, ANGLE, RATE = 0.4, 0.01, 1.2, 3.0  # m, m, rad, rad/s
BENT = f"""
name: bent
water: {{density: 1000 kg/m3, gravity: 0 m/s2}}
body:
  kind: rigid
  shape: box
  length: 100 mm
  width: 20 mm
  height: 60 mm
  mass: 1 kg
  volume: 0 m3
  joint: {{kind: prismatic, axis: x, motion: {{kind: rate, rate: {RATE} m/s}}}}
  loads: {{drag: {{kind: lumped_drag, drag_area: [2 cm2, 0 m2, 0 m2]}}}}
limbs:
  arm:
    on: body
    kind: rod
    section: circle
    length: {LENGTH} m
    radius: {RADIUS} m
    young: 1 MPa
    density: 1000 kg/m3
    strains: {{bending_z: 0}}
    points: 12
    joint: {{kind: fixed}}
"""


@pytest.fixture(scope="module")
def run():
    robot = parse_robot(BENT)
    return simulate(build(robot), 0.1, samples=3).to_dataset()


def test_a_box_keeps_its_corners_and_goes_along(run):
    box = bodies_of(run, parse_robot(BENT))["body"]
    assert isinstance(box, RigidMesh)
    np.testing.assert_allclose(np.abs(box.vertices).max(axis=0), [0.05, 0.01, 0.03], atol=1e-12)
    np.testing.assert_allclose(box.place[-1] - box.place[0], [0.1 * RATE, 0, 0], atol=1e-9)
    np.testing.assert_allclose(box.turn, np.tile([1, 0, 0, 0], (3, 1)), atol=1e-12)


def test_slices_follow_each_other_along_a_rod_without_gaps(run):
    arm = bodies_of(run, parse_robot(BENT))["arm"]
    assert isinstance(arm, Soft)
    place, turn, size = arm.slices(2)
    ahead = Rotation.from_quat(turn, scalar_first=True).as_matrix()[:, :, 0]
    ends, starts = place + 0.5 * size[:, :1] * ahead, place - 0.5 * size[:, :1] * ahead
    assert np.all(np.einsum("kx,kx->k", ends[:-1] - starts[1:], ahead[1:]) > 0)
    np.testing.assert_allclose(size[:, 1:], 2 * RADIUS)
    np.testing.assert_allclose(arm.place[2], [0.1 * RATE + 0.1, 0, 0], atol=1e-9)  # the root, at the end of the box
    assert np.linalg.norm(np.diff(place, axis=0), axis=1).sum() == pytest.approx(LENGTH, rel=0.05)


def test_discs_close_both_ends_of_a_rod(run):
    """They stand across it, as wide as it is there, no farther from its ends than slices overlap."""
    arm = bodies_of(run, parse_robot(BENT))["arm"]
    assert isinstance(arm, Soft)
    slices = arm.slices(2)
    place, turn, size = slices.ends
    np.testing.assert_allclose(place, [[0, 0, 0], [LENGTH, 0, 0]], atol=0.05 * slices.size[:, 0].max())
    np.testing.assert_allclose(Rotation.from_quat(turn, scalar_first=True).as_matrix(), [np.eye(3)] * 2, atol=1e-9)
    vertices, faces = disc_mesh()
    np.testing.assert_allclose((vertices * size[1]).max(axis=0), [0, RADIUS, RADIUS], atol=1e-12)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    area = 0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()
    assert area == pytest.approx(0.125 * AROUND * np.sin(2 * np.pi / AROUND), rel=1e-12)


def test_colours_of_curvature_are_those_of_an_arc():
    """Its angle over its length."""
    robot = parse_robot(BENT)
    bent = standing(robot, build(robot)).copy(deep=True)
    own = np.flatnonzero(bent["station_part"].values == "arm")
    x, k = bent["station_x"].values[own], ANGLE / LENGTH
    bent["rotation"].values[0, own] = Rotation.from_euler("z", k * x[:, None]).as_matrix()
    bent["position"].values[0, own] = np.stack([np.sin(k * x) / k, (1 - np.cos(k * x)) / k, 0 * x], axis=-1)
    arm = bodies_of(bent, robot)["arm"]
    np.testing.assert_allclose(arm.shown("curvature"), k, rtol=2e-3)
    assert arm.shown("material") is None


def test_arrows_are_forces_in_the_colour_of_their_load(run):
    arrows = arrows_of(run)
    assert "drag" in arrows.names
    which = arrows.load == arrows.names.index("drag")
    np.testing.assert_allclose(arrows.force[1, which], [[-0.5 * 1000 * 2e-4 * RATE**2, 0, 0]], rtol=1e-9)
    assert arrows_of(run.drop_vars("load_force")).names == ()


def test_a_slice_is_the_wall_of_a_cylinder_of_size_one():
    vertices, faces = slice_mesh()
    np.testing.assert_allclose(np.ptp(vertices, axis=0), 1, atol=1e-12)
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normal = 0.5 * np.cross(b - a, c - a)
    assert np.linalg.norm(normal, axis=1).sum() == pytest.approx(AROUND * np.sin(np.pi / AROUND), rel=1e-12)
    assert np.all(np.einsum("ij,ij->i", normal, (a + b + c) / 3) > 0)  # turned outwards


def test_colours_go_from_dark_to_light():
    found = colours(np.array([0.0, 1.0, 2.0, 5.0]), 2.0)
    light = found.astype(int).sum(axis=1)
    assert light[0] < light[1] < light[2] == light[3]
    np.testing.assert_array_equal(colours(np.zeros(2), 0.0), colours(np.array([0.0, 0.0]), 1.0))

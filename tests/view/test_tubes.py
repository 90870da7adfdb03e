import numpy as np
import pytest
from tests.made_up_runs import LENGTH, RADIUS, TIP

from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.view.still import standing
from nectosome.view.tubes import AROUND, PartLook, hermite, look_of, parts_of, rings_of, triangles, tubes


def radii(rings):
    return np.linalg.norm(rings - rings.mean(axis=-2, keepdims=True), axis=-1)


def test_rings_lie_half_a_width_from_the_axis(run):
    rings = rings_of(parts_of(run)["filament"], PartLook())
    x = rings[0, :, :, 0].mean(axis=-1) - 0.085
    assert x[0] == x[1] == pytest.approx(0) and x[-1] == x[-2] == pytest.approx(LENGTH)
    expected = np.broadcast_to(np.interp(x, [0, LENGTH], [RADIUS, TIP])[:, None], rings.shape[1:3])
    np.testing.assert_allclose(radii(rings), np.broadcast_to(expected, rings.shape[:3]), rtol=1e-9)


def test_a_rigid_part_without_strips_is_drawn_from_end_to_end(run):
    rings = rings_of(parts_of(run)["body"], PartLook())
    np.testing.assert_allclose(radii(rings), 0.04, rtol=1e-12)
    assert rings[0, 0, :, 0] == pytest.approx(0) and rings[0, -1, :, 0] == pytest.approx(0.085)


def test_a_box_reaches_its_corners(run):
    rings = rings_of(parts_of(run)["body"], PartLook(square=True))
    across = rings[0, 0, :, 1:]
    np.testing.assert_allclose(np.max(np.abs(across), axis=-1), 0.04)
    assert np.sum(np.isclose(np.min(np.abs(across), axis=-1), 0.04)) == 4


def test_a_spheroid_closes_at_its_poles(run):
    robot = parse_robot("{name: a, body: {kind: rigid, shape: spheroid, length: 85 mm, radius: 40 mm, mass: 1 kg}}")
    rings = rings_of(parts_of(run)["body"], look_of(robot, "body"))
    r = radii(rings)[0, :, 0]
    assert r[0] == pytest.approx(0) and r[-1] == pytest.approx(0) and r.max() == pytest.approx(0.04)


def test_the_surface_is_closed_and_faces_outwards(run):
    """Every edge belongs to two triangles that run through it in opposite senses; the volume is that of the prism."""
    rings = rings_of(parts_of(run)["body"], PartLook())
    points, faces = rings[0].reshape(-1, 3), triangles(rings.shape[1], AROUND)
    _, merged = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    edges = [tuple(e) for f in merged[faces] for e in ((f[0], f[1]), (f[1], f[2]), (f[2], f[0]))]
    assert len(set(edges)) == len(edges)
    assert {(b, a) for a, b in edges} == set(edges)
    a, b, c = points[faces].swapaxes(0, 1)
    section = 0.5 * AROUND * np.sin(2 * np.pi / AROUND) * 0.04**2
    assert np.einsum("ni,ni->", a, np.cross(b, c)) / 6 == pytest.approx(section * 0.085)


def test_cubics_are_exact_for_cubics():
    x = np.array([0.0, 0.4, 1.0])
    at = np.linspace(0, 1, 9)
    np.testing.assert_allclose(hermite(x, x**3 - x, 3 * x**2 - 1, at), at**3 - at, atol=1e-15)


def test_between_saved_times_the_rings_keep_their_size(run):
    rings = tubes(run, np.array([0.333, 0.512]))["filament"]
    np.testing.assert_allclose(radii(rings)[:, 0], RADIUS, rtol=2e-3)


@pytest.mark.parametrize(("given", "volume"), [("volume: 0.1 L", 1e-4), ("volume: 0 m3", 2e-4)])
def test_a_robot_of_points_is_drawn_as_balls(given, volume):
    """Of their volume; of as much water as they weigh where they have none."""
    joint = "{kind: prismatic, axis: z, position: 0.3 m}"
    robot = parse_robot(f"{{name: ball, body: {{kind: rigid, shape: point, mass: 200 g, {given}, joint: {joint}}}}}")
    rings = tubes(standing(robot, build(robot)), np.array([0.0]))["body"][0]
    far = np.linalg.norm(rings - [0, 0, 0.3], axis=-1)
    np.testing.assert_allclose(far, (3 * volume / (4 * np.pi)) ** (1 / 3), rtol=1e-9)
    assert tubes(standing(robot, build(robot)).drop_attrs(), np.array([0.0])) == {}  # nobody knows their mass

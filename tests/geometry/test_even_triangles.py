"""Even triangles: the same closed surface, with about as many triangles as asked for."""

import numpy as np
import pytest
import trimesh
from tests.geometry import closed_surfaces as made

from nectosome.geometry.even_triangles import even_triangles


def from_box(x, *sides):
    """Distance of points from the surface of a box [m], exact near its sides."""
    return np.abs(np.max(np.abs(x) - 0.5 * np.asarray(sides), axis=1))


def from_cylinder(x):
    return np.abs(np.maximum(np.hypot(x[:, 0], x[:, 1]) - 0.1, np.abs(x[:, 2]) - 2))


# surface, the distance of points from it [m], the most of that with 1000 triangles
SHAPES = {
    "ball": (made.spheroid(1, 1, 5), lambda x: np.abs(np.linalg.norm(x, axis=1) - 1), 0.01),
    "spheroid": (made.spheroid(6, 1, 5), lambda x: np.abs(np.linalg.norm(x / [6, 1, 1], axis=1) - 1), 0.03),
    "cube": (made.box(1, 1, 1), lambda x: from_box(x, 1, 1, 1), 1e-3),
    "plate": (made.box(1, 1, 0.02), lambda x: from_box(x, 1, 1, 0.02), 1e-3),
    "cylinder": (made.cylinder(4, 0.1), from_cylinder, 0.016),  # what its section loses makes it longer
    "ring": (
        made.of(trimesh.creation.torus(1.0, 0.3)),
        lambda x: np.abs(np.hypot(np.hypot(x[:, 0], x[:, 1]) - 1, x[:, 2]) - 0.3),
        0.015,
    ),
}


@pytest.mark.parametrize("name", SHAPES)
@pytest.mark.parametrize("count", [250, 1000])
def test_the_surface_stays_what_it_is(name, count):
    surface, distance, near = SHAPES[name]
    even = even_triangles(surface, count)
    mesh = trimesh.Trimesh(*even, process=False)
    assert 0.7 * count <= len(even.faces) <= count
    assert mesh.is_watertight and mesh.is_winding_consistent
    assert mesh.euler_number == trimesh.Trimesh(*surface, process=False).euler_number
    assert even.solid.size == pytest.approx(surface.solid.size, rel=1e-9)
    assert distance(even.vertices).max() < near * 1000 / count
    assert mesh.area == pytest.approx(trimesh.Trimesh(*surface, process=False).area, rel=15 / count)


@pytest.mark.parametrize("name", ["ball", "cube", "cylinder"])
def test_triangles_are_about_as_long_as_wide_and_of_one_size(name):
    even = even_triangles(SHAPES[name][0], 600)
    sides = np.linalg.norm(even.vertices[even.faces] - even.vertices[np.roll(even.faces, 1, axis=1)], axis=2)
    assert np.median(sides.max(axis=1) / sides.min(axis=1)) < 2.2
    assert sides.max() < 2.5 * np.median(sides) and np.quantile(sides, 0.02) > 0.3 * np.median(sides)


def test_sharp_corners_stay():
    even = even_triangles(made.box(1, 2, 3), 500)
    corners = made.box(1, 2, 3).vertices
    assert np.linalg.norm(corners[:, None] - even.vertices, axis=2).min(axis=1).max() < 1e-3


def test_long_and_thin_triangles_of_a_fine_cylinder():
    """Five thousand strips, 300 times as long as wide."""
    surface = made.of(trimesh.creation.cylinder(0.1, 0.04, sections=5000))
    even = even_triangles(surface, 600)
    mesh = trimesh.Trimesh(*even, process=False)
    assert 400 <= len(even.faces) <= 600 and mesh.is_watertight
    assert even.surface.size == pytest.approx(surface.surface.size, rel=0.01)
    sides = np.linalg.norm(even.corners - np.roll(even.corners, 1, axis=1), axis=2)
    assert np.quantile(sides.max(axis=1) / sides.min(axis=1), 0.9) < 4

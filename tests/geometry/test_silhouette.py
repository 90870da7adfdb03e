"""Shadows and areas of surfaces in closed form."""

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation
from tests.geometry import closed_surfaces as made

from nectosome.geometry.mesh_numbers import projected_areas
from nectosome.geometry.triangles import Triangles, area_vectors


def both(one, other):
    return Triangles(
        np.concatenate([one.vertices, other.vertices]), np.concatenate([one.faces, other.faces + len(one.vertices)])
    )


def test_a_box():
    assert projected_areas(made.box(1, 2, 3)) == pytest.approx([6, 3, 2], rel=1e-9)
    assert made.box(1, 2, 3).surface.size == pytest.approx(22, rel=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_convex_bodies_in_any_attitude(seed):
    """Half of what all triangles have of their areas along the axis (Cauchy)."""
    surface = made.turned(made.box(1, 0.3, 2), Rotation.random(random_state=seed).as_matrix())
    cauchy = 0.5 * np.abs(area_vectors(surface.corners)).sum(axis=0)
    assert projected_areas(surface) == pytest.approx(cauchy, rel=2e-4)


def test_a_spheroid():
    surface = made.spheroid(3, 0.5, 5)
    assert projected_areas(surface) == pytest.approx(np.pi * np.array([0.25, 1.5, 1.5]), rel=2e-3)
    e = np.sqrt(1 - (0.5 / 3) ** 2)
    assert surface.surface.size == pytest.approx(2 * np.pi * 0.25 * (1 + 3 / (0.5 * e) * np.arcsin(e)), rel=3e-3)


def test_a_ring_lets_one_see_through():
    found = projected_areas(made.of(trimesh.creation.torus(1.0, 0.25, major_sections=256, minor_sections=64)))
    assert found[2] == pytest.approx(np.pi * (1.25**2 - 0.75**2), rel=2e-3)
    assert found[0] == pytest.approx(2 * 2 * 0.25 + np.pi * 0.25**2, rel=2e-3)


def test_what_is_behind_counts_once():
    box = made.box(1, 1, 1)
    aside = made.turned(box, np.eye(3), (3.0, 0.5, 0))
    assert projected_areas(both(box, aside)) == pytest.approx([1.5, 2, 2], rel=4e-3)


def test_fine_triangles_change_nothing():
    """Long ones, each of which many rows cross."""
    cylinder = made.of(trimesh.creation.cylinder(0.1, 5, sections=2000))
    assert projected_areas(cylinder) == pytest.approx([1.0, 1.0, np.pi * 0.01], rel=5e-3)

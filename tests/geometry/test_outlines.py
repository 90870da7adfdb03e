"""Pieces and faces of outlines: they make up what the outline bounds, whatever its form."""

import numpy as np
import pytest

from nectosome.geometry.outlines import plate_faces, trapezoids

# a forked tail, whose lines across x cross it twice at its end, and one with corners over one another
FORK = np.array(
    [[0, 3], [15, 8], [45, 45], [60, 50], [48, 20], [45, 0], [48, -20], [60, -50], [45, -45], [15, -8], [0, -3]]
)
COMB = np.array([[0, 0], [50, 0], [50, 30], [40, 30], [40, 10], [30, 10], [30, 30], [20, 30], [20, 10], [0, 10]])


def area(points: np.ndarray) -> float:
    x, y = points[..., 0], points[..., 1]
    return 0.5 * np.sum(x * np.roll(y, -1, axis=-1) - y * np.roll(x, -1, axis=-1), axis=-1)


@pytest.mark.parametrize("outline", [FORK, COMB, FORK[::-1], COMB @ [[0.8, 0.6], [-0.6, 0.8]]])
def test_trapezoids_are_counterclockwise_and_have_the_area_of_the_outline(outline: np.ndarray):
    pieces = trapezoids(outline.astype(float))
    assert (area(pieces) > 0).all()
    assert area(pieces).sum() == pytest.approx(abs(area(outline)), rel=1e-13)


@pytest.mark.parametrize("outline", [FORK, COMB, FORK[::-1], COMB @ [[0.8, 0.6], [-0.6, 0.8]]])
def test_faces_of_a_plate_enclose_its_volume_with_normals_outwards(outline: np.ndarray):
    """Volume and areas by Gauss: V = 1/3 sum x . n dA, and sum n dA = 0 for a closed surface."""
    faces = plate_faces(outline.astype(float), 2.0)
    triangles = np.concatenate([faces[:, [0, 1, 2]], faces[:, [0, 2, 3]]])
    normals = 0.5 * np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    volume = np.sum(normals * triangles.mean(axis=1)) / 3
    assert volume == pytest.approx(2.0 * abs(area(outline)), rel=1e-13)
    np.testing.assert_allclose(normals.sum(axis=0), 0, atol=1e-10)

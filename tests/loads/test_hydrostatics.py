"""Closed surfaces cut by the water's surface: closed forms, any cut of any convex body, derivatives."""

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation
from tests.geometry import closed_surfaces as made

from nectosome.geometry.triangles import Triangles
from nectosome.loads.buoyancy import raised

UP = np.array([0.0, 0.0, 1.0])


class Immersed(NamedTuple):
    """What the derivatives of E are."""

    volume: jax.Array
    moment: jax.Array
    waterplane: jax.Array
    waterplane_moment: jax.Array
    waterplane_second: jax.Array


@jax.jit
def immersed(corners, place):
    def energy(place):
        return raised(corners, place[0], place[1:])

    first, second = jax.grad(energy)(place), jax.hessian(energy)(place)
    return Immersed(first[0], -first[1:], second[0, 0], -second[0, 1:], second[1:, 1:])


def under(surface, depth, up=UP):
    return immersed(jnp.asarray(surface.corners), jnp.asarray([depth, *up]))


def test_a_box_on_even_keel():
    found = under(made.box(2, 1, 0.5), 0.1)
    assert float(found.volume) == pytest.approx(2 * 0.35, rel=1e-14)
    assert np.asarray(found.moment) == pytest.approx([0, 0, 0.7 * (0.1 - 0.35 / 2)], abs=1e-15)
    assert float(found.waterplane) == pytest.approx(2, rel=1e-14)
    assert np.asarray(found.waterplane_moment) == pytest.approx([0, 0, 0.2], abs=1e-14)
    second = [[2**3 / 12, 0, 0], [0, 2 / 12, 0], [0, 0, 0.02]]
    assert np.asarray(found.waterplane_second) == pytest.approx(np.array(second), abs=1e-14)


def test_the_corner_of_a_cube():
    """A tetrahedron of three edges a, cut off by an equilateral triangle."""
    a = 0.3
    up = -np.ones(3) / np.sqrt(3)  # the corner (1/2, 1/2, 1/2) is the lowest
    found = under(made.box(1, 1, 1), -(np.sqrt(3) / 2 - a / np.sqrt(3)), up)
    assert float(found.volume) == pytest.approx(a**3 / 6, rel=1e-13)
    assert np.asarray(found.moment) == pytest.approx(a**3 / 6 * (0.5 - a / 4) * np.ones(3), rel=1e-13)
    assert float(found.waterplane) == pytest.approx(np.sqrt(3) / 2 * a**2, rel=1e-13)


def test_all_but_the_corner_of_a_cube():
    a = 0.3
    up = np.ones(3) / np.sqrt(3)
    found = under(made.box(1, 1, 1), np.sqrt(3) / 2 - a / np.sqrt(3), up)
    assert float(found.volume) == pytest.approx(1 - a**3 / 6, rel=1e-13)
    assert float(found.waterplane) == pytest.approx(np.sqrt(3) / 2 * a**2, rel=1e-12)


def test_balls_of_more_triangles_come_nearer_to_a_cap():
    """Height h of a ball of radius 1: pi h^2 (3 - h) / 3, a waterplane of pi h (2 - h); a quarter of the error each."""
    h, errors = 0.7, []
    for fineness in (2, 3, 4):
        found = under(made.spheroid(1, 1, fineness), h - 1, np.array([0.48, 0.6, 0.64]))
        exact = np.pi * h**2 * (3 - h) / 3, np.pi * h * (2 - h)
        errors.append([1 - float(found.volume) / exact[0], 1 - float(found.waterplane) / exact[1]])
    errors = np.array(errors)
    assert np.all(errors > 0) and errors[-1] == pytest.approx(0, abs=4e-3)
    assert errors[:-1] / errors[1:] == pytest.approx(4, rel=0.2)


@pytest.mark.parametrize("depth", [2.0, 500.0])
def test_deep_water_holds_all_and_no_waterplane(depth):
    found = under(made.box(2, 1, 0.5), depth, np.array([0.6, 0, 0.8]))
    assert float(found.volume) == pytest.approx(1, rel=1e-10)
    assert np.asarray(found.moment) == pytest.approx(np.zeros(3), abs=1e-9)
    assert float(found.waterplane) == pytest.approx(0, abs=1e-12)
    dry = under(made.box(2, 1, 0.5), -depth, np.array([0.6, 0, 0.8]))
    assert float(dry.volume) == float(dry.waterplane) == 0


def test_a_ring_is_under_water_by_half():
    ring = made.revolved(np.array([0.0, 0.0, 0.4, 0.4]), np.array([0, 0.5, 0.5, 0]), 40)
    hollow = made.revolved(np.array([0.0, 0.0, 0.4, 0.4]), np.array([0, 0.3, 0.3, 0]), 40)
    both = Triangles(
        np.concatenate([ring.vertices, hollow.vertices]),
        np.concatenate([ring.faces, hollow.faces[:, ::-1] + len(ring.vertices)]),
    )
    found = under(both, 0.0)
    polygon = 20 * np.sin(2 * np.pi / 40)  # area of radius 1
    assert float(found.volume) == pytest.approx(0.5 * 0.4 * polygon * (0.5**2 - 0.3**2), rel=1e-12)
    assert float(found.waterplane) == pytest.approx(0.4 * 2 * (0.5 - 0.3), rel=1e-12)


@pytest.mark.parametrize("seed", range(8))
def test_any_cut_of_any_convex_body(seed):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(30, 3))
    hull = ConvexHull(points)
    a, b, c = points[hull.simplices].swapaxes(0, 1)
    outward = np.einsum("ij,ij->i", np.cross(b - a, c - a), hull.equations[:, :3]) > 0
    faces = np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1])
    up, depth = Rotation.random(random_state=seed).as_matrix()[2], rng.normal(scale=0.6)
    found = under(Triangles(points, faces), depth, up)
    s = depth - points @ up
    edges = faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2)
    p, q = edges[s[edges[:, 0]] * s[edges[:, 1]] < 0].T
    cut = points[p] + (s[p] / (s[p] - s[q]))[:, None] * (points[q] - points[p])
    wet = ConvexHull(np.concatenate([points[np.unique(faces)][s[np.unique(faces)] > 0], cut]))
    assert float(found.volume) == pytest.approx(wet.volume, rel=1e-11)
    flat = np.linalg.svd(up[None])[2][1:]
    plane = ConvexHull(cut @ flat.T)
    assert float(found.waterplane) == pytest.approx(plane.volume, rel=1e-11)
    corners = (cut @ flat.T)[plane.vertices]
    x, y = corners.T
    x2, y2 = np.roll(x, -1), np.roll(y, -1)
    cross = x * y2 - x2 * y
    second = np.sum(cross * (x * x + x * x2 + x2 * x2)) / 12
    assert flat[0] @ np.asarray(found.waterplane_second) @ flat[0] == pytest.approx(second, rel=1e-10)
    assert flat[0] @ np.asarray(found.waterplane_moment) == pytest.approx(np.sum(cross * (x + x2)) / 6, abs=1e-11)


def test_a_prism_that_heels_moves_its_buoyancy_by_the_waterplane():
    """Boat of a triangular section, b wide at the water and t deep: BM = I / V with I = L b^3 / 12, V = L b t / 2."""
    section = np.array([[0.0, -0.5], [1.0, 0.5], [-1.0, 0.5]])  # y, z
    vertices = np.concatenate([np.insert(section, 0, x, axis=1) for x in (-1.5, 1.5)])
    faces = [[0, 2, 1], [3, 4, 5], [0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4], [2, 0, 3], [2, 3, 5]]
    surface, t, b, heel = Triangles(vertices, np.array(faces)), 0.5, 1.0, 1e-4
    assert float(under(surface, 2.0).volume) == pytest.approx(3.0, rel=1e-14)
    tilted = under(surface, 0.0, np.array([0, np.sin(heel), np.cos(heel)]))
    moved = float(tilted.moment[1] / tilted.volume)
    assert -moved / np.tan(heel) == pytest.approx((b**3 / 12) / (b * t / 2), rel=1e-6)


def test_derivatives_are_those_of_finite_differences():
    corners = jnp.asarray(made.spheroid(2, 0.7, 1).corners)
    place = np.array([0.1, *np.array([0.36, 0.48, 0.8])])

    def energy(corners, place):
        return raised(corners, place[0], place[1:])

    def volume(corners, place):
        return immersed(corners, place).volume

    rng, h = np.random.default_rng(1), 1e-5
    for f in (energy, volume):
        slopes = jax.jit(jax.grad(f, argnums=(0, 1)))(corners, jnp.asarray(place))
        f = jax.jit(f)
        for _ in range(3):
            way = rng.normal(size=corners.shape), rng.normal(size=4)
            ahead, back = (float(f(corners + sign * h * way[0], place + sign * h * way[1])) for sign in (1, -1))
            slope = sum(float(np.sum(np.asarray(s) * w)) for s, w in zip(slopes, way, strict=True))
            assert slope == pytest.approx((ahead - back) / (2 * h), rel=1e-7)


def test_derivatives_are_numbers_where_corners_touch_the_water():
    """Level sides, corners and edges in the surface, dry and wet triangles at once."""
    surface = made.box(1, 1, 1)
    slopes = jax.jit(jax.grad(lambda corners, place: immersed(corners, place).volume))
    for depth, up in ((0.5, UP), (-0.5, UP), (0.0, UP), (0.0, np.array([0, 1, 1]) / np.sqrt(2))):
        assert np.all(np.isfinite(slopes(jnp.asarray(surface.corners), jnp.asarray([depth, *up]))))
        assert np.all(np.isfinite(np.concatenate([np.ravel(x) for x in under(surface, depth, up)])))

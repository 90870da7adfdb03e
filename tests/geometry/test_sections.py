"""Sections of meshes as outlines of plates: closed forms, corners that are known, what is no outline."""

import numpy as np
import pytest
import trimesh

from nectosome.geometry.sections import read_section, thinned
from nectosome.units import InputError

N = 240
T = 2 * np.pi * np.arange(N) / N
RING = np.stack([60 + 60 * np.cos(T), 25 * np.sin(T), 0 * T], axis=1)


def wing() -> trimesh.Trimesh:
    """Two cones over an ellipse of 120 mm by 50 mm, 10 mm high: an ellipse in each plane across z."""
    sides = [[k, (k + 1) % N] for k in range(N)]
    faces = [[a, b, N] for a, b in sides] + [[b, a, N + 1] for a, b in sides]
    return trimesh.Trimesh(np.concatenate([RING, [[60, 0, 10], [60, 0, -10]]]), faces, process=False)


def area(points: np.ndarray) -> float:
    x, y = points.T
    return float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) / 2)


def read(mesh: trimesh.Trimesh, tmp_path, **options) -> np.ndarray:
    mesh.export(tmp_path / "fin.stl")
    return read_section(tmp_path / "fin.stl", "mm", **{"plane": "xy", **options})


def refusal(mesh: trimesh.Trimesh, tmp_path, **options) -> str:
    with pytest.raises(InputError) as found:
        read(mesh, tmp_path, **options)
    return str(found.value)


def test_the_section_of_a_box_has_its_four_corners(tmp_path):
    """Whatever triangles its sides have."""
    box = trimesh.creation.box((80.0, 40.0, 6.0)).subdivide().subdivide()
    flat = {(-0.04, -0.02), (0.04, -0.02), (0.04, 0.02), (-0.04, 0.02)}
    assert {tuple(p) for p in read(box, tmp_path, across=1e-3).tolist()} == flat
    upright = read(box, tmp_path, plane="xz", origin=(-0.04, 0.0))
    assert {tuple(p) for p in upright.tolist()} == {(0.0, -0.003), (0.08, -0.003), (0.08, 0.003), (0.0, 0.003)}
    assert area(upright) == pytest.approx(80e-3 * 6e-3, rel=1e-12)


@pytest.mark.parametrize("across", [-3e-3, 3e-3])
def test_a_part_that_stands_on_the_plane_has_the_outline_of_its_foot(tmp_path, across):
    box = trimesh.creation.box((80.0, 40.0, 6.0))
    assert area(read(box, tmp_path, across=across)) == pytest.approx(80e-3 * 40e-3, rel=1e-12)


def test_sections_of_an_elliptic_wing_are_its_ellipses(tmp_path):
    """Corner by corner in the plane of its edge, of area (1 - |z|/h)^2 of that elsewhere; outlines have 7 digits."""
    whole = read(wing(), tmp_path, tolerance=0.0)
    order = np.lexsort(whole.round(6).T)
    exact = 1e-3 * RING[:, :2]
    assert whole[order] == pytest.approx(exact[np.lexsort(exact.round(6).T)], abs=1e-7)
    polygon = np.pi * 60e-3 * 25e-3 * np.sin(2 * np.pi / N) / (2 * np.pi / N)
    for z in (-7e-3, 0.0, 2e-3):
        found = area(read(wing(), tmp_path, across=z, tolerance=0.0, origin=(0.06, 0.0)))
        assert found == pytest.approx(polygon * (1 - abs(z) / 10e-3) ** 2, rel=1e-6)


def test_fewer_corners_stay_within_the_tolerance(tmp_path):
    every = read(wing(), tmp_path, tolerance=0.0)
    for tolerance, most in ((1e-4, 80), (1e-3, 25)):
        few = read(wing(), tmp_path, tolerance=tolerance)
        assert len(few) < most
        a, b = few, np.roll(few, -1, axis=0)
        share = np.clip(np.einsum("pci,ci->pc", every[:, None] - a, b - a) / np.sum((b - a) ** 2, axis=1), 0, 1)
        away = np.linalg.norm(every[:, None] - a - share[..., None] * (b - a), axis=-1).min(axis=1)
        assert away.max() <= tolerance + 2e-7


def test_a_line_that_is_straight_but_for_its_corners_keeps_them():
    square = np.array([[0, 0], [0.3, 0], [1, 0], [1, 1], [0.5, 1], [0, 1], [0, 0.2]], float)
    assert {tuple(p) for p in thinned(square, 1e-9).tolist()} == {(0, 0), (1, 0), (1, 1), (0, 1)}


def test_what_is_no_outline_is_told(tmp_path):
    box = trimesh.creation.box((80.0, 40.0, 6.0))
    apart = box.copy()
    apart.apply_translation([0, 100, 0])
    assert "fin.stl: its section is empty: the plane is at 10 mm along z, the mesh from -3 mm to 3 mm." in refusal(
        box, tmp_path, across=0.01
    )
    two = "its section consists of 2 closed lines, where one is expected. A plate has no holes and is one piece"
    assert two in refusal(trimesh.util.concatenate([box, apart]), tmp_path)
    assert two in refusal(trimesh.creation.torus(50, 10), tmp_path)
    apart.apply_translation([100, 0, 0])
    away = refusal(apart, tmp_path)
    assert "from 60 mm to 140 mm along x and 80 mm to 120 mm along y, away from its own origin" in away


def test_a_closed_cavity_is_no_hole(tmp_path):
    """It has no water, and the outline is that of the outside."""
    inside = trimesh.creation.box((60.0, 20.0, 2.0))
    inside.invert()
    hollow = trimesh.util.concatenate([trimesh.creation.box((80.0, 40.0, 6.0)), inside])
    assert area(read(hollow, tmp_path)) == pytest.approx(80e-3 * 40e-3, rel=1e-12)

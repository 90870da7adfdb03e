"""What is measured of meshes, against closed forms of the polyhedron that they are."""

import math
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from nectosome.geometry import UNITS, Measured, Triangles, measure, pack_surface, simplified, unpack_surface
from nectosome.geometry.triangles import separate

TURN = Rotation.from_euler("xyz", [20, -35, 70], degrees=True).as_matrix()
AWAY = np.array([3.0, -2.0, 0.7])


def along_x(radius: float, length: float, corners: int) -> trimesh.Trimesh:
    """A prism of so many corners along x, about 0."""
    mesh = trimesh.creation.cylinder(radius, length, sections=corners)
    return mesh.apply_transform(trimesh.transformations.rotation_matrix(0.5 * np.pi, [0, 1, 0]))


def measured(mesh: trimesh.Trimesh, folder: Path, unit: str = "m", name: str = "part.ply") -> Measured:
    """By way of a file; PLY keeps all digits."""
    path = folder / name
    if path.suffix == ".ply":
        path.write_bytes(_ply(mesh.vertices, mesh.faces))
    else:
        mesh.export(path)
    return measure(path, unit)


def _ply(vertices: np.ndarray, faces: np.ndarray) -> bytes:
    head = f"ply\nformat ascii 1.0\nelement vertex {len(vertices)}\n"
    head += "".join(f"property double {axis}\n" for axis in "xyz")
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    rows = [" ".join(map(repr, row)) for row in vertices.tolist()]
    rows += [f"3 {' '.join(map(str, face))}" for face in faces.tolist()]
    return (head + "\n".join(rows) + "\n").encode()


def test_a_box_has_the_moments_of_a_box(tmp_path):
    a, b, c = 0.3, 0.04, 0.05
    found = measured(trimesh.creation.box((a, b, c)).apply_translation(AWAY), tmp_path)
    volume = a * b * c
    assert found.displaced.size == pytest.approx(volume, rel=1e-12)
    assert found.displaced.centre == pytest.approx(AWAY, abs=1e-12)
    expected = volume / 12 * np.diag([b * b + c * c, a * a + c * c, a * a + b * b])
    assert found.matter.inertia == pytest.approx(expected, rel=1e-9, abs=1e-12 * volume)
    assert found.skin.size == pytest.approx(2 * (a * b + b * c + c * a), rel=1e-12)
    # two faces across x: 2 bc (a/2)^2 away from the middle, each with bc c^2/12 about y, and so on
    about_x = (
        (2 * a * b * (c * c / 4 + b * b / 12)) + 2 * a * c * (b * b / 4 + c * c / 12) + b * c * (b * b + c * c) / 6
    )
    assert found.skin.inertia[0, 0] == pytest.approx(about_x, rel=1e-9)
    assert found.projected == pytest.approx([b * c, a * c, a * b], rel=1e-9)
    assert not found.told
    assert found.slices.share == pytest.approx(1 / 60, rel=1e-9)
    assert found.slices.half == pytest.approx(np.tile([b / 2, c / 2], (60, 1)), rel=1e-9)


def test_a_prism_has_the_moments_of_a_regular_polygon(tmp_path):
    """A = n/2 r^2 sin t, t = 2 pi/n; second moment about the axis A r^2 (2 + cos t)/6, half of it across."""
    n, r, length = 24, 0.02, 0.3
    found = measured(along_x(r, length, n), tmp_path)
    t = 2 * math.pi / n
    area = 0.5 * n * r * r * math.sin(t)
    polar = area * r * r * (2 + math.cos(t)) / 6
    assert found.displaced.size == pytest.approx(area * length, rel=1e-12)
    expected = np.diag([polar, *[0.5 * polar + area * length**2 / 12] * 2]) * length
    assert found.matter.inertia == pytest.approx(expected, rel=1e-9, abs=1e-12 * expected[0, 0])
    assert found.projected[0] == pytest.approx(area, rel=1e-4)  # rows of a shadow, each as at its middle
    assert found.projected[1:] == pytest.approx(2 * r * length, rel=1e-4)


def test_a_fine_ball_is_a_ball(tmp_path):
    """Inscribed: less volume by (edge/radius)^2/5 or so, which is 0.05 % with 20480 triangles."""
    r = 0.05
    found = measured(trimesh.creation.icosphere(5, radius=r), tmp_path)
    volume = 4 / 3 * math.pi * r**3
    assert found.displaced.size == pytest.approx(volume, rel=1e-3)
    assert found.matter.inertia == pytest.approx(np.eye(3) * 0.4 * volume * r * r, rel=2e-3, abs=1e-9 * volume * r * r)
    assert found.skin.inertia == pytest.approx(
        np.eye(3) * 2 / 3 * 4 * math.pi * r**4, rel=1e-3, abs=1e-9 * r**4
    )  # of a thin shell, 2/3 m r^2
    assert found.projected == pytest.approx([math.pi * r * r] * 3, rel=1e-3)
    assert len(found.surface.faces) <= 8000
    assert found.surface.solid.size == pytest.approx(volume, rel=0.002)


SPHEROID = trimesh.creation.icosphere(4).apply_scale([0.15, 0.045, 0.045])
KEEL = trimesh.creation.box((0.09, 0.014, 0.03)).apply_translation([0.01, 0, -0.062])


def test_each_of_many_bodies_is_kept_where_and_as_large_as_it_is(tmp_path):
    """30 balls and rings, of which 500 triangles would be 16 each, a box, a thin plate and a thin tetrahedron."""
    ball, ring = trimesh.creation.icosphere(3, radius=0.02), trimesh.creation.torus(0.02, 0.004, 48, 16)
    bodies = [(ball, ring)[k % 2].copy().apply_translation([0.05 * k, 0.1 * (k % 3), 0]) for k in range(30)]
    bodies.append(trimesh.creation.box((0.03, 0.03, 0.03)).apply_translation([-0.1, 0, 0]))
    bodies.append(trimesh.creation.box((0.1, 0.1, 1e-4)).subdivide().subdivide().apply_translation([-0.3, 0, 0]))
    tetrahedron = trimesh.convex.convex_hull([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.002]])
    bodies.append(tetrahedron.apply_scale(0.1).apply_translation([-0.3, 0, 0.1]))
    found = separate(measured(trimesh.util.concatenate(bodies), tmp_path).surface)
    assert len(found) == 33
    for mesh in bodies:
        one = min(found, key=lambda x: np.linalg.norm(x.solid.centre - mesh.center_mass))
        assert one.solid.centre == pytest.approx(mesh.center_mass, abs=1e-8)
        assert one.volume == pytest.approx(mesh.volume, rel=1e-8)
        assert np.ptp(one.bounds, axis=0) == pytest.approx(mesh.extents, rel=0.08)


@pytest.mark.parametrize(
    ("mesh", "volume", "extent"),
    [
        (trimesh.util.concatenate([SPHEROID, KEEL]), 1e-4, 0.025),  # scaled to its volume
        (trimesh.creation.icosphere(5).apply_scale([0.06, 0.3, 2.5e-3]), 0.1, 0.1),
        (trimesh.creation.icosphere(6).apply_scale([0.06, 0.3, 2.5e-3]), 0.1, 0.1),
        (trimesh.creation.box((0.2, 0.06, 3e-3)).subdivide().subdivide().subdivide(), 0.01, 0.01),
        (trimesh.creation.torus(0.08, 0.008, 64, 32), 0.06, 0.1),
    ],
    ids=["keel below a hull", "wing", "finer wing", "plate", "ring"],
)
def test_a_surface_for_pictures_keeps_thin_parts_and_ends(mesh, volume, extent, tmp_path):
    """Its volume, its extents and that it is closed; triangles within a curved surface take volume off a lone body."""
    found = measured(mesh, tmp_path)
    drawn = simplified(found.surface, 500)
    assert len(drawn.faces) <= 500
    assert drawn.volume == pytest.approx(found.displaced.size, rel=volume)
    assert np.ptp(drawn.bounds, axis=0) == pytest.approx(np.ptp(found.bounds, axis=0), rel=extent)
    sides = drawn.faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2)
    forth, back = (np.unique(s @ [1, len(drawn.vertices)], return_counts=True) for s in (sides, sides[:, ::-1]))
    assert np.array_equal(forth[0], back[0]) and np.array_equal(forth[1], back[1])


def test_slices_add_up_and_are_those_of_the_body(tmp_path):
    """A spheroid between planes: pi b^2 [x - x^3/(3 a^2)]."""
    a, b = 0.15, 0.03
    found = measured(trimesh.creation.icosphere(5, radius=1).apply_scale([a, b, b]).apply_translation(AWAY), tmp_path)
    cut = found.slices
    assert cut.share.sum() == pytest.approx(1, abs=1e-12)
    assert cut.share @ cut.centre == pytest.approx(found.displaced.centre, abs=1e-12)
    edge = np.linspace(-a, a, 61)
    exact = np.diff(math.pi * b * b * (edge - edge**3 / (3 * a * a))) / (4 / 3 * math.pi * a * b * b)
    assert cut.share == pytest.approx(exact, abs=2e-3 * exact.max())
    middle = b * np.sqrt(1 - (0.5 * (edge[1:] + edge[:-1]) / a) ** 2)
    assert cut.half[5:-5, 0] == pytest.approx(middle[5:-5], rel=5e-3)
    for n in (1, 5, 7, 60):  # also numbers that do not divide 60
        joined = cut.joined(n)
        assert joined.share.sum() == pytest.approx(1, abs=1e-12)
        assert joined.share @ joined.centre == pytest.approx(found.displaced.centre, abs=1e-12)


@pytest.mark.parametrize("suffix", ["stl", "obj", "ply"])
@pytest.mark.parametrize("unit", list(UNITS))
def test_all_formats_and_units_say_the_same(tmp_path, suffix, unit):
    """Text and single precision keep six digits and more."""
    mesh = along_x(0.02, 0.3, 12).apply_translation([0.1, 0.2, 0])
    exact = measured(mesh, tmp_path)
    found = measured(mesh.copy().apply_scale(1 / UNITS[unit]), tmp_path, unit, f"other.{suffix}")
    assert found.displaced.size == pytest.approx(exact.displaced.size, rel=1e-5)
    assert found.displaced.centre == pytest.approx(exact.displaced.centre, rel=1e-6, abs=1e-8)
    assert found.matter.inertia == pytest.approx(exact.matter.inertia, rel=1e-5, abs=1e-5 * exact.matter.inertia[0, 0])


def test_the_text_of_an_stl_says_what_its_binary_does(tmp_path):
    mesh = along_x(20, 300, 12)
    binary = measured(mesh, tmp_path, "mm", "binary.stl")
    (tmp_path / "text.stl").write_bytes(mesh.export(file_type="stl_ascii").encode())
    text = measure(tmp_path / "text.stl", "mm")
    assert text.displaced.size == pytest.approx(binary.displaced.size, rel=1e-6)
    assert text.triangles == binary.triangles == len(mesh.faces)


def test_moments_turn_and_move_with_the_mesh(tmp_path):
    mesh = trimesh.creation.box((0.3, 0.04, 0.05))
    mesh.vertices[:, 1] += 0.3 * mesh.vertices[:, 0]  # a parallelepiped, so that all moments differ
    before = measured(mesh, tmp_path)
    moved = mesh.copy()
    moved.vertices = mesh.vertices @ TURN.T + AWAY
    after = measured(moved, tmp_path)
    assert after.displaced.size == pytest.approx(before.displaced.size, rel=1e-10)
    assert after.displaced.centre == pytest.approx(TURN @ before.displaced.centre + AWAY, abs=1e-10)
    for turned, own in ((after.matter, before.matter), (after.skin, before.skin)):
        expected = TURN @ own.inertia @ TURN.T
        assert turned.inertia == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_the_smallest_surface_reads_back():
    """A tetrahedron has four corners and four triangles."""
    corners, faces = np.eye(4)[:, :3], np.array([(0, 1, 2), (0, 3, 1), (0, 2, 3), (1, 3, 2)])
    again = unpack_surface(pack_surface(Triangles(corners, faces)))
    assert (again.faces == faces).all()
    assert again.vertices == pytest.approx(corners, abs=1e-15)


def test_a_surface_as_text_reads_back(tmp_path):
    surface = measured(trimesh.creation.icosphere(4).apply_translation(AWAY), tmp_path).surface
    text = pack_surface(surface)
    again = unpack_surface(text)
    assert len(text) < 40_000
    assert (again.faces == surface.faces).all()
    assert np.abs(again.vertices - surface.vertices).max() < 2.0 / 65535
    assert pack_surface(again) == text
    assert isinstance(again, Triangles)
    for damaged in ("", "abc", text[:-8], text.replace(text[10:14], "AAAA", 1)):
        with pytest.raises(ValueError, match="cut or changed"):
            unpack_surface(damaged)

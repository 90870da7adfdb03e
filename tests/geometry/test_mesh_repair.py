"""Files of meshes that are no clean body: repaired and told where that is safe, else refused in a sentence."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from nectosome.geometry import measure, mesh_files
from nectosome.geometry.triangles import linked
from nectosome.units import InputError

BOX = trimesh.creation.box((100.0, 40.0, 50.0))
FINE = BOX.subdivide().subdivide()  # 192 triangles


def told(mesh: trimesh.Trimesh | list[trimesh.Trimesh], folder: Path) -> tuple[float, str]:
    """Volume [mm3], and what is told."""
    mesh = trimesh.util.concatenate(mesh) if isinstance(mesh, list) else mesh
    mesh.export(folder / "part.stl")
    found = measure(folder / "part.stl", "mm")
    return found.displaced.size * 1e9, "; ".join(found.told)


def refusal(mesh: trimesh.Trimesh | list[trimesh.Trimesh], folder: Path) -> str:
    with pytest.raises(InputError) as error:
        told(mesh, folder)
    return str(error.value)


def test_normals_are_turned_outwards_and_that_is_told(tmp_path):
    inside_out = FINE.copy()
    inside_out.invert()
    volume, words = told(inside_out, tmp_path)
    assert volume == pytest.approx(2e5, rel=1e-9)
    assert "normals turned round" in words

    mixed = FINE.copy()
    mixed.faces[[3, 70, 71, 150]] = mixed.faces[[3, 70, 71, 150], ::-1]
    volume, words = told(mixed, tmp_path)
    assert volume == pytest.approx(2e5, rel=1e-9)
    assert "normals turned round to agree with those beside them: 4" in words


def test_a_small_flat_hole_is_closed_and_told(tmp_path):
    holed = trimesh.Trimesh(FINE.vertices, np.delete(FINE.faces, [10], axis=0))
    volume, words = told(holed, tmp_path)
    assert volume == pytest.approx(2e5, rel=1e-9)
    assert "holes closed by flat faces: 1, with 0.28 % of its area" in words  # 40 x 50/2/16 of 22000


def test_holes_that_are_large_or_not_flat_are_refused(tmp_path):
    lid = np.flatnonzero(FINE.face_normals[:, 2] > 0.9)
    assert "not closed: holes have 22 % of the area" in refusal(
        trimesh.Trimesh(FINE.vertices, np.delete(FINE.faces, lid, axis=0)), tmp_path
    )
    corner = np.flatnonzero((FINE.vertices[FINE.faces] == FINE.vertices.max(axis=0)).all(axis=2).any(axis=1))
    assert len(corner) >= 3
    assert "is not flat" in refusal(trimesh.Trimesh(FINE.vertices, np.delete(FINE.faces, corner, axis=0)), tmp_path)


def test_a_sheet_and_a_one_sided_strip_are_no_bodies(tmp_path):
    sheet = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [1, 1, 0.2], [0, 1, 0]], [[0, 1, 2], [0, 2, 3]])
    assert "not closed" in refusal(sheet, tmp_path)
    both_sides = trimesh.Trimesh(sheet.vertices, np.concatenate([sheet.faces, sheet.faces[:, ::-1]]))
    assert "encloses no volume" in refusal(both_sides, tmp_path)
    n = 40
    angle = np.linspace(0, 2 * np.pi, n, endpoint=False)
    side = np.array([-1, 1])[:, None]
    width = 0.3 * side * np.cos(0.5 * angle)
    strip = np.stack([(1 + width) * np.cos(angle), (1 + width) * np.sin(angle), 0.3 * side * np.sin(0.5 * angle)], -1)
    here, there = np.arange(n), (np.arange(n) + 1) % n
    twist = there == 0
    low, high = np.where(twist, there + n, there), np.where(twist, there, there + n)
    faces = np.concatenate([np.stack([here, low, high], -1), np.stack([here, high, here + n], -1)])
    assert "one side only" in refusal(trimesh.Trimesh(strip.reshape(-1, 3), faces, process=False), tmp_path)


def test_separate_bodies_make_one_part(tmp_path):
    volume, words = told([BOX, BOX.copy().apply_translation([0, 0, 80])], tmp_path)
    assert volume == pytest.approx(4e5, rel=1e-9)
    assert "separate bodies, which make one part: 2" in words
    # also where they touch in an edge or in a face
    for away in ([100, 40, 0], [100, 0, 0]):
        assert told([BOX, BOX.copy().apply_translation(away)], tmp_path)[0] == pytest.approx(4e5, rel=1e-9)


def test_a_closed_cavity_holds_neither_matter_nor_water(tmp_path):
    hollow = trimesh.creation.box((80.0, 20.0, 30.0)).apply_translation([5, 0, 0])
    hollow.invert()
    trimesh.util.concatenate([BOX, hollow]).export(tmp_path / "part.stl")
    found = measure(tmp_path / "part.stl", "mm")
    assert found.displaced.size == pytest.approx(2e-4, rel=1e-9)
    assert found.matter.size == pytest.approx(1.52e-4, rel=1e-9)
    assert found.displaced.centre == pytest.approx([0, 0, 0], abs=1e-12)
    assert found.matter.centre[0] == pytest.approx(-5e-3 * 0.48 / 1.52, rel=1e-9)
    assert found.skin.size == pytest.approx(2.2e-2, rel=1e-9)
    assert any("cavities" in words for words in found.told)

    both = trimesh.util.concatenate([BOX, hollow])
    both.invert()  # the whole file inside out
    volume, words = told(both, tmp_path)
    assert volume == pytest.approx(2e5, rel=1e-9)
    assert "2 of 2 surfaces" in words
    hollow.invert()
    assert "lies within another one" in refusal([BOX, hollow], tmp_path)


def test_overlaps_are_told_by_their_share_and_refused_where_they_count(tmp_path):
    """Two boxes of 2e5 mm3 whose common part is 40 x 50 x depth."""
    volume, words = told([BOX, BOX.copy().apply_translation([99, 0, 0])], tmp_path)
    assert "parts of it overlap" in words
    assert volume == pytest.approx(4e5, rel=1e-9)
    words = refusal([BOX, BOX.copy().apply_translation([50, 0, 0])], tmp_path)
    assert "parts of it overlap" in words
    share = float(words.split("about ")[1].split(" %")[0])
    assert share == pytest.approx(33, abs=3)  # 1e5 of the 3e5 that both fill; along 300 lines


def test_a_cavity_is_found_wherever_its_faces_lie_below_those_of_the_body(tmp_path):
    """The middle of its first face is below the diagonal of the box's top, which is an edge."""
    solid, hollow = trimesh.creation.box((2, 2, 2)), trimesh.creation.box((0.3, 0.3, 0.3))
    hollow.invert()
    x, y, _ = hollow.triangles[0].mean(axis=0)
    for side in (-0.2, 0.2):
        moved = hollow.copy().apply_translation([0.2 - x, side - y, 0])
        volume, words = told([solid, moved], tmp_path)
        assert "closed cavities, without matter and without water: 1" in words
        assert volume == pytest.approx(8, rel=1e-9)


TOUCHING = {
    "other triangles in the face between": ([100, 0, 0], True),
    "in a part of a side": ([60, 30, 50], True),
    "one in the other by 0.2 mm": ([99.8, 0, 0], True),
    "in an edge": ([100, 40, 0], True),
    "0.1 mm apart": ([100.1, 0, 0], False),
    "apart within one box around both": ([0, 41, 0], False),
}


@pytest.mark.parametrize("name", TOUCHING)
def test_bodies_that_touch_or_overlap_are_told(tmp_path, name):
    """Faces between them count as wetted, unless they are the same triangles on both sides."""
    away, touch = TOUCHING[name]
    _, words = told([BOX, FINE.copy().apply_translation(away)], tmp_path)
    assert ("bodies in it touch or overlap: faces that lie inside count as wetted" in words) == touch
    assert measure(tmp_path / "part.stl", "mm").touch == touch


def test_faces_between_bodies_that_share_their_corners(tmp_path):
    """A face of two triangles with the same diagonal on both sides is left out, with another one it is told."""
    told([BOX, BOX.copy().apply_translation([100, 0, 0])], tmp_path)
    assert measure(tmp_path / "part.stl", "mm").touch
    image = BOX.copy()
    image.vertices[:, 0] *= -1
    image.invert()
    told([BOX, image.apply_translation([100, 0, 0])], tmp_path)
    found = measure(tmp_path / "part.stl", "mm")
    assert not found.touch
    assert found.skin.size == pytest.approx(2 * (200 * 40 + 40 * 50 + 200 * 50) * 1e-6, rel=1e-9)


def test_a_ring_around_a_ball_does_not_touch_it(tmp_path):
    """Of the same middle; 20 480 triangles, so that they are looked at part by part."""
    ball, ring = trimesh.creation.icosphere(5), trimesh.creation.annulus(1.01, 1.2, 0.5, sections=256)
    for one, touch in ((ring, False), (ring.copy().apply_translation([0.02, 0, 0]), True)):
        assert ("touch or overlap" in told([ball, one], tmp_path)[1]) == touch


def test_a_unit_that_makes_no_sense_is_told(tmp_path):
    BOX.export(tmp_path / "part.stl")
    for unit, extent in (("m", "100 m"), ("ft", "30.48 m")):
        (words,) = measure(tmp_path / "part.stl", unit).told
        assert extent in words
        assert f"check the unit, {unit}" in words
    assert not measure(tmp_path / "part.stl", "mm").told
    BOX.copy().apply_scale(0.01).export(tmp_path / "small.stl")
    assert "check the unit, mm" in measure(tmp_path / "small.stl", "mm").told[0]


def _stl() -> bytes:
    return FINE.export(file_type="stl")


def _with_nan() -> bytes:
    data = bytearray(_stl())
    data[84 + 12 : 84 + 16] = np.float32(np.nan).tobytes()
    return bytes(data)


TEXT = FINE.export(file_type="stl_ascii").encode()
PLY = FINE.export(file_type="ply")
OBJ = FINE.export(file_type="obj").encode()
BAD = {
    "empty.stl": (b"", "is empty"),
    "empty.obj": (b"  \n", "is empty"),
    "empty.ply": (b"", "is empty"),
    "none.stl": (bytes(84), "has no triangles"),
    "text_none.stl": (b"solid a\nendsolid a\n", "has no triangles"),
    "none.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\n", "has no triangles"),
    "none.ply": (b"ply\nformat ascii 1.0\nelement vertex 0\nend_header\n", "has no triangles"),
    "cut.stl": (_stl()[:-70], "cut off"),
    "short.stl": (b"\0" * 50, "no STL file"),
    "longer.stl": (_stl() + b"12345", "longer than that"),
    "text_cut.stl": (TEXT[:-300], "cut off"),
    "cut.ply": (PLY[:-300], "cut off"),
    "cut.obj": (OBJ[: OBJ.index(b"\nf ") + 6], "no triangles"),
    "many.stl": (bytes(80) + (10**7).to_bytes(4, "little") + bytes(50), "tells 10000000 triangles, 1 are there"),
    "many.ply": (PLY.replace(b"element vertex ", b"element vertex 99999999999"), "cut off"),
    "prose.stl": (b"solid words and no more of it, but long enough for the header of a file that is none. " * 3, "STL"),
    "prose.obj": (b"this is a poem\nof two lines\n", "no OBJ file"),
    "prose.ply": (b"ply is a word\n" * 20, "no PLY file"),
    "binary.obj": (_stl(), "no OBJ file"),
    "text_in_binary.stl": (_stl()[:84] + b"x" * 300, "no STL file, or cut off"),
    "nan.stl": (_with_nan(), "NaN"),
    "nan.obj": (OBJ.replace(b"v ", b"v nan ", 1), "OBJ|NaN"),
    "gone.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 1\nf 1 2 9\n", "damaged"),
    "flat.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "is flat"),
    "points.obj": (b"v 0 0 0\nv 1 1 1\nv 2 2 2\nf 1 2 2\n", "without area"),
    "part.step": (b"ISO-10303-21;", "its name must end in .stl, .obj or .ply"),
    "part.3mf": (b"PK", "its name must end in"),
    "part": (_stl(), "its name must end in"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_bad_file_gets_a_sentence(tmp_path, name):
    data, words = BAD[name]
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=words) as error:
        measure(tmp_path / name, "mm", name)
    assert str(error.value).startswith(name)
    assert len(str(error.value)) < 300


def test_a_missing_file_a_folder_and_a_pipe_get_a_sentence(tmp_path):
    (tmp_path / "folder.stl").mkdir()
    for name in ("gone.stl", "folder.stl"):
        with pytest.raises(InputError, match="cannot be read"):
            measure(tmp_path / name, "mm")
    os.mkfifo(tmp_path / "pipe.stl")
    with pytest.raises(InputError, match="cannot be read"):
        measure(tmp_path / "pipe.stl", "mm")


def test_more_triangles_than_the_bound_are_refused_before_they_are_read(tmp_path, monkeypatch):
    monkeypatch.setattr(mesh_files, "MOST_TRIANGLES", 100)
    monkeypatch.setattr(mesh_files, "_loaded", None)
    for kind in ("stl", "obj", "ply"):
        FINE.export(tmp_path / f"part.{kind}")
        with pytest.raises(InputError, match="has 192 triangles, at most 100"):
            measure(tmp_path / f"part.{kind}", "mm")
    monkeypatch.setattr(mesh_files, "MOST_BYTES", 1000)
    with pytest.raises(InputError, match="too large"):
        measure(tmp_path / "part.stl", "mm")


def test_other_files_that_an_obj_names_are_not_opened(tmp_path):
    os.mkfifo(tmp_path / "part.mtl")  # who opens it waits for ever
    (tmp_path / "part.obj").write_bytes(b"mtllib part.mtl\nusemtl a\n" + OBJ)
    assert measure(tmp_path / "part.obj", "mm").displaced.size == pytest.approx(2e-4, rel=1e-6)


@pytest.mark.parametrize("seed", range(4))
def test_damaged_files_are_bodies_or_get_a_sentence(tmp_path, seed, capfd):
    """Bytes cut off, changed, taken out, put in: what is still read is a body that a solid can have."""
    rng = np.random.default_rng(seed)
    ball = trimesh.creation.icosphere(1, radius=30).apply_scale([2, 1, 0.5])
    for name in ("text.stl", "part.stl", "part.ply", "part.obj"):
        kind = "stl_ascii" if name == "text.stl" else name[-3:]
        made = ball.export(file_type=kind)
        whole = made if isinstance(made, bytes) else made.encode()
        for _ in range(25):
            data, a = bytearray(whole), int(rng.integers(len(whole)))
            change = rng.integers(4)
            if change == 0:
                del data[a:]
            elif change == 1:
                del data[a : a + int(rng.integers(1, 200))]
            elif change == 2:
                data[a:a] = rng.bytes(int(rng.integers(1, 50)))
            else:
                data[a] = rng.choice([*b"0123456789-. e\n\0\xff"])
            (tmp_path / name).write_bytes(data)
            try:
                found = measure(tmp_path / name, "mm")
            except InputError as error:
                assert len(str(error)) < 400
                continue
            least, middle, most = np.linalg.eigvalsh(found.matter.inertia)
            assert 0 < least <= middle <= most <= (least + middle) * (1 + 1e-9)
            assert found.displaced.size >= found.matter.size > 0
            assert np.isfinite(found.projected).all()
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(("n", "links"), [(1, 0), (9, 0), (40, 25), (400, 380), (400, 2000)])
def test_groups_of_links_are_the_components_of_their_graph(n, links):
    one, other = np.random.default_rng(n + links).integers(n, size=(2, links))
    graph = coo_array((np.ones(links), (one, other)), shape=(n, n))
    np.testing.assert_array_equal(linked(n, one, other), connected_components(graph, directed=False)[1])


def test_a_chain_named_against_its_order_is_one_group():
    n = 1000
    names = np.random.default_rng(1).permutation(n)
    assert not linked(n, names[:-1], names[1:]).any()


def test_a_binary_stl_is_measured_without_what_is_slow_to_import(tmp_path):
    FINE.export(tmp_path / "part.stl")
    code = """
import sys
from nectosome.geometry import measure
print(round(1e9 * measure(sys.argv[1], "mm").displaced.size), {"scipy", "trimesh", "jax"} & {*sys.modules})
"""
    argv = [sys.executable, "-c", code, str(tmp_path / "part.stl")]
    assert subprocess.run(argv, capture_output=True, text=True, check=True).stdout == "200000 set()\n"

"""Robot files whose parts are meshes: what is measured goes along, so that the file of the mesh is needed once."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import trimesh

from nectosome.description import Rigid, apply_settings, dump_robot, load_robot, numeric_paths, parse_robot, save_robot
from nectosome.description.meshes import MeshShape
from nectosome.description.plausible import implausible
from nectosome.description.shapes import shape_forms
from nectosome.io.yaml_text import MAX_BYTES
from nectosome.units import InputError

NAMED = ", ".join(form for form, shape in shape_forms().items() if not shape.model_fields)

ROBOT = """
name: hull
body:
  kind: rigid
  shape: SHAPE
  density: 900 kg/m3
  joint: {kind: free}
"""
SKEW = trimesh.creation.box((300.0, 40.0, 50.0))
SKEW.vertices[:, 1] += 0.3 * SKEW.vertices[:, 0] + 10
SKEW.vertices[:, 2] += 0.1 * SKEW.vertices[:, 1]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    SKEW.export(tmp_path / "hull.stl")
    return tmp_path


def written(folder: Path, shape: str = "{mesh: hull.stl, unit: mm}", text: str = ROBOT) -> Path:
    (folder / "robot.yaml").write_text(text.replace("SHAPE", shape))
    return folder / "robot.yaml"


def mesh_of(robot, part: str = "body") -> MeshShape:
    limb = robot.parts[part]
    assert isinstance(limb, Rigid)
    assert isinstance(limb.shape, MeshShape)
    return limb.shape


def test_a_dumped_robot_is_the_same_robot_without_the_mesh(folder):
    robot = load_robot(written(folder, "{mesh: hull.stl, unit: mm, thickness: 1 mm}"))
    text = dump_robot(robot)
    (folder / "hull.stl").unlink()
    assert parse_robot(text) == robot
    assert dump_robot(parse_robot(text)) == text
    save_robot(robot, folder / "moved.yaml")
    assert load_robot(folder / "moved.yaml") == robot


def test_a_dumped_mesh_stays_small(folder):
    trimesh.creation.icosphere(5, radius=50).export(folder / "hull.stl")
    text = dump_robot(load_robot(written(folder)))
    assert len(text) < 80_000 < MAX_BYTES / 40


def test_a_changed_mesh_is_measured_anew_and_that_is_told(folder):
    save_robot(load_robot(written(folder)), folder / "robot.yaml")
    before = load_robot(folder / "robot.yaml")
    assert not [sentence for _, sentence in implausible(before) if "mesh" in sentence]
    SKEW.copy().apply_scale(2).export(folder / "hull.stl")
    after = load_robot(folder / "robot.yaml")
    assert mesh_of(after).numbers.volume == pytest.approx(8 * mesh_of(before).numbers.volume, rel=1e-6)
    assert ("body.shape", "hull.stl: the file has changed since it was measured: measured anew") in implausible(after)
    (folder / "hull.stl").write_bytes(b"")
    with pytest.raises(InputError, match=r"robot.yaml, body.shape.mesh: hull.stl: is empty"):
        load_robot(folder / "robot.yaml")


def test_what_was_measured_is_kept_by_the_contents_of_the_file(folder, monkeypatch):
    monkeypatch.setenv("NECTOSOME_CACHE", str(folder / "cache"))
    first = load_robot(written(folder))
    with monkeypatch.context() as without:
        without.setattr("nectosome.geometry.measured_bytes", None)  # it would fail if it were called
        assert load_robot(written(folder)) == first
        (folder / "same.stl").write_bytes((folder / "hull.stl").read_bytes())
        same = mesh_of(load_robot(written(folder, "{mesh: same.stl, unit: mm}"))).numbers
        assert same == mesh_of(first).numbers.model_copy(update={"file": "same.stl"})
    (kept,) = (folder / "cache" / "meshes").iterdir()
    kept.write_bytes(kept.read_bytes()[:-1])
    assert load_robot(written(folder)) == first
    SKEW.copy().apply_scale(2).export(folder / "hull.stl")
    for unit, factor in (("mm", 8), ("cm", 8000)):
        other = mesh_of(load_robot(written(folder, f"{{mesh: hull.stl, unit: {unit}}}"))).numbers
        assert other.volume == pytest.approx(factor * mesh_of(first).numbers.volume, rel=1e-6)


@pytest.mark.parametrize(("change", "factor"), [("unit: cm", 1000), ("mirrored: true", 1), ("mesh: other.stl", 8)])
def test_what_was_measured_does_not_stand_for_another_mesh(folder, change, factor):
    """Of a robot file that was saved, and in which people changed a word."""
    before = load_robot(written(folder))
    old = {"unit": "unit: mm", "mirrored": "unit: mm", "mesh": "mesh: hull.stl"}[change.partition(":")[0]]
    new = f"{old}\n    {change}" if change.startswith("mirrored") else change
    text = dump_robot(before).replace(old, new, 1)
    SKEW.copy().apply_scale(2).export(folder / "other.stl")
    (folder / "robot.yaml").write_text(text)
    after = mesh_of(load_robot(folder / "robot.yaml")).numbers
    assert after.volume == pytest.approx(factor * mesh_of(before).numbers.volume, rel=1e-6)
    assert after.centre[1] == pytest.approx(
        mesh_of(before).numbers.centre[1] * (-1 if factor == 1 else factor ** (1 / 3)), rel=1e-6
    )
    for name in ("hull.stl", "other.stl"):
        (folder / name).unlink()
    with pytest.raises(InputError, match=r"body.shape.mesh: \w+.stl: cannot be read"):
        load_robot(folder / "robot.yaml")


def test_a_setting_does_not_stretch_what_was_measured(folder, monkeypatch):
    robot = load_robot(written(folder))
    assert apply_settings(robot, ["body.density=800 kg/m3"]).body.shape == robot.body.shape
    with pytest.raises(InputError, match=r"body.shape.mesh: hull\.stl: cannot be read"):
        apply_settings(robot, ["body.shape.unit=cm"])
    monkeypatch.chdir(folder)
    assert mesh_of(apply_settings(robot, ["body.shape.unit=cm"])).size("length") == pytest.approx(3.0, rel=1e-6)


def test_text_of_a_robot_is_not_measured_anew_by_a_file_that_happens_to_be_there(folder, monkeypatch):
    """As that of a saved run."""
    robot = load_robot(written(folder))
    SKEW.copy().apply_scale(2).export(folder / "hull.stl")
    monkeypatch.chdir(folder)
    assert parse_robot(dump_robot(robot)) == robot


def test_what_was_found_is_told(folder):
    inside_out = SKEW.copy()
    inside_out.invert()
    inside_out.export(folder / "hull.stl")
    ((path, sentence),) = implausible(load_robot(written(folder)))
    assert path == "body.shape"
    assert "normals turned round" in sentence
    large = [*implausible(load_robot(written(folder, "{mesh: hull.stl, unit: m}")))]
    assert large[0] == ("body.shape", "hull.stl: its largest extent is 300 m: check the unit, m")


def test_the_image_of_a_mesh_is_that_of_the_mirrored_file(folder):
    text = (
        ROBOT.replace("shape: SHAPE", "shape: point").replace("density: 900 kg/m3", "mass: 1 kg\n  inertia: [1, 1, 1]")
        + """
limbs:
  fin:
    kind: rigid
    shape: {mesh: hull.stl, unit: mm}
    density: 900 kg/m3
    offset: [0 m, 100 mm, 0 m]
    repeat: {mirror: y}
"""
    ).replace("[1, 1, 1]", "[1 kg m2, 1 kg m2, 1 kg m2]")
    robot = load_robot(written(folder, text=text))
    first, second = (mesh_of(robot, part).numbers for part in robot.limbs)
    image = SKEW.copy()
    image.vertices[:, 1] *= -1
    image.invert()
    image.export(folder / "image.stl")
    other = mesh_of(load_robot(written(folder, "{mesh: image.stl, unit: mm}"))).numbers
    for field in ("centre", "low", "high", "matter_centre", "matter_inertia", "area_centre", "area_inertia"):
        expected = np.array(getattr(other, field))
        assert getattr(second, field) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max()), field
    a, b = mesh_of(robot, list(robot.limbs)[1]), mesh_of(load_robot(folder / "robot.yaml"))
    assert a.slices.centre == pytest.approx(b.slices.centre, abs=1e-9)
    assert a.surface.solid.size == pytest.approx(b.surface.solid.size, rel=1e-4)
    assert first.centre[1] == -second.centre[1] != 0
    again = parse_robot(dump_robot(robot))
    assert again == robot
    assert mesh_of(again, list(robot.limbs)[1]).mirrored


def test_numbers_of_the_mesh_are_data_and_the_thickness_is_a_quantity(folder):
    robot = load_robot(written(folder, "{mesh: hull.stl, unit: mm, thickness: 1 mm}"))
    assert "body.shape.thickness" in numeric_paths(robot)
    assert not [path for path in numeric_paths(robot) if "measured" in path]


BAD = {
    "{mesh: gone.stl, unit: mm}": "line 5, body.shape.mesh: gone.stl: cannot be read: No such file",
    "{mesh: hull.stl}": "body.shape.unit: is missing. One of m, cm, mm, in, ft expected",
    "{mesh: hull.stl, unit: km}": 'body.shape.unit: "km" is not known here',
    "{mesh: ../hull.stl, unit: mm}": "body.shape.mesh: ../hull.stl is outside of the folder of the robot file",
    "{mesh: /etc/passwd, unit: mm}": "body.shape.mesh: /etc/passwd is outside of the folder",
    "{mesh: link.stl, unit: mm}": "body.shape.mesh: link.stl is outside of the folder",
    "{mesh: robot.yaml, unit: mm}": "body.shape.mesh: robot.yaml: is no mesh that can be read: its name must end in",
    '{mesh: "", unit: mm}': "body.shape.mesh",
    '{mesh: "a\\0.stl", unit: mm}': "body.shape.mesh: is no name of a file",
    "{mesh: hull.stl, unit: mm, scale: 2}": 'body.shape.scale: there is no field "scale" here',
    "{mesh: hull.stl, unit: mm, thickness: 1}": 'body.shape.thickness: "1" has no unit',
    "{mesh: hull.stl, unit: mm, thickness: 1 m}": "more matter than the solid part: it must be at most",
    "{mesh: hull.stl, unit: mm, measured: {volume: 1}}": "body.shape.measured",
    "{}": "body.shape.mesh: is missing",
    "[hull.stl]": "body.shape: a list is not known here",
    "ball": f'body.shape: "ball" is not known here. Known: {NAMED}. Or a mesh, as in',
    "{mesh: hull.stl, unit: mm}\n  length: 1 m": "body.length: a mesh has no length, it has the size of its file",
    "{mesh: hull.stl, unit: mm}\n  bend: 10 deg": "body.bend: a mesh has no bend",
    "{mesh: hull.stl, unit: mm}\n  strips: 61": "body.strips: a mesh has at most 60",
    "{mesh: hull.stl, unit: mm}\n  loads: {a: {kind: spheroid_added_mass}}": "acts on spheroid, not on a mesh",
}


@pytest.mark.parametrize("shape", BAD)
def test_a_mistake_is_told_with_its_field(folder, shape):
    outside = folder / "elsewhere"
    outside.mkdir()
    shutil.move(folder / "hull.stl", outside / "hull.stl")
    inner = outside / "robots"
    inner.mkdir()
    shutil.copy(outside / "hull.stl", inner / "hull.stl")
    (inner / "link.stl").symlink_to(outside / "hull.stl")
    with pytest.raises(InputError) as error:
        load_robot(written(inner, shape))
    assert BAD[shape] in str(error.value)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_damaged_measures_are_told(folder):
    text = dump_robot(load_robot(written(folder)))
    for field in ("slices", "surface"):
        at = text.index(f"{field}: ") + len(field) + 12
        damaged = text[:at] + ("A" if text[at] != "A" else "B") + text[at + 1 :]
        with pytest.raises(InputError, match=f"shape.measured.{field}: it was cut or changed"):
            parse_robot(damaged)
    with pytest.raises(InputError, match="volume"):
        parse_robot(text.replace("volume: ", "volume: -"))

"""Added mass of parts that are meshes: closed forms, mirror images, what goes along with a robot and what does not."""

import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh

from nectosome.description import RobotDescription, dump_robot, load_robot, parse_robot, save_robot, with_values
from nectosome.description import mesh_added_mass as described
from nectosome.geometry import panel_added_mass as panels
from nectosome.model import build
from nectosome.units import InputError

HALF, RADIUS = 0.15, 0.04
ROBOT = """
name: hull
water: {density: 1025 kg/m3, gravity: 0 m/s2}
body:
  kind: rigid
  SHAPE
  density: 1000 kg/m3
  joint: {kind: free}
  loads: {water: {kind: LOAD}}
"""


@pytest.fixture(scope="module", autouse=True)
def capytaine():
    return pytest.importorskip("capytaine")


@pytest.fixture(autouse=True)
def fresh_cache(tmp_path, monkeypatch):
    monkeypatch.setenv("NECTOSOME_CACHE", str(tmp_path / "cache"))
    described._by_panels.cache_clear()


@pytest.fixture
def without_capytaine(monkeypatch):
    """Call it to take the package away."""

    def taken_away() -> None:
        monkeypatch.setitem(sys.modules, "capytaine", None)
        described._by_panels.cache_clear()
        panels._capytaine.cache_clear()

    yield taken_away
    panels._capytaine.cache_clear()


def spheroid(scale: float = 1.0) -> trimesh.Trimesh:
    """In mm, its centre away from the origin of its frame."""
    mesh = trimesh.creation.icosphere(4)
    mesh.vertices = scale * (1e3 * mesh.vertices * [HALF, RADIUS, RADIUS] + [100, 20, -10])
    return mesh


def skew() -> trimesh.Trimesh:
    """Without any plane of symmetry."""
    mesh = trimesh.creation.box((200.0, 60.0, 40.0))
    mesh.vertices[:, 1] += 0.3 * mesh.vertices[:, 0] + 10
    mesh.vertices[:, 2] += 0.4 * mesh.vertices[:, 1] * (mesh.vertices[:, 0] > 0)
    return mesh


def written(folder: Path, mesh: trimesh.Trimesh, load: str = "mesh_added_mass", more: str = "") -> Path:
    mesh.export(folder / "hull.stl")
    text = ROBOT.replace("SHAPE", f"shape: {{mesh: hull.stl, unit: mm{more}}}").replace("LOAD", load)
    (folder / "robot.yaml").write_text(text)
    return folder / "robot.yaml"


def added(robot: RobotDescription) -> np.ndarray:
    """Added mass about the centre of the part."""
    return np.sum(np.asarray(build(robot).added), axis=0)


def test_a_mesh_of_a_spheroid_carries_what_the_spheroid_does(tmp_path):
    """Rotation about its own axis aside, for which the spheroid has none."""
    found = added(load_robot(written(tmp_path, spheroid())))
    shape = f"shape: spheroid\n  length: {2 * HALF} m\n  radius: {RADIUS} m"
    exact = added(parse_robot(ROBOT.replace("SHAPE", shape).replace("LOAD", "spheroid_added_mass")))
    assert np.diag(found)[1:] == pytest.approx(np.diag(exact)[1:], rel=0.02)
    scale = np.sqrt([exact[1, 1], *np.diag(exact)[1:]])
    assert found / np.outer(scale, scale) == pytest.approx(exact / np.outer(scale, scale), abs=0.02)


def test_it_goes_with_the_density_of_the_water(tmp_path):
    robot = load_robot(written(tmp_path, skew()))

    def carried(density):
        return jnp.sum(build(with_values(robot, {"water.density": density})).added, axis=0)

    slope = np.asarray(jax.jacfwd(carried)(1025.0))
    assert added(robot) == pytest.approx(1025.0 * slope, rel=1e-12, abs=1e-15)
    assert np.abs(slope).max() > 1e-4


def test_a_mirror_image_carries_the_image(tmp_path):
    """Computed of the image, and of the mesh and then mirrored: by other panels, to their error."""
    plain, image = load_robot(written(tmp_path, skew())), load_robot(written(tmp_path, skew(), more=", mirrored: true"))
    assert plain.body is not None
    mirrored = added(plain.model_copy(update={"body": plain.body.image()}))
    signs = np.array([-1, 1, -1, 1, -1, 1])
    assert mirrored == pytest.approx(np.outer(signs, signs) * added(plain), rel=1e-12)
    size = np.sqrt(np.diag(mirrored))
    assert added(image) / np.outer(size, size) == pytest.approx(mirrored / np.outer(size, size), abs=0.02)
    assert np.abs((mirrored - added(plain)) / np.outer(size, size)).max() > 0.1


def test_a_saved_robot_needs_neither_mesh_nor_package(tmp_path, without_capytaine):
    robot = load_robot(written(tmp_path, skew()))
    before = added(robot)
    save_robot(robot, tmp_path / "moved.yaml")
    (tmp_path / "hull.stl").unlink()
    without_capytaine()
    again = load_robot(tmp_path / "moved.yaml")
    assert again == robot
    assert dump_robot(again) == (tmp_path / "moved.yaml").read_text()
    assert np.array_equal(added(again), before)


def test_without_the_mesh_and_without_what_was_computed_it_is_told(tmp_path):
    robot = load_robot(written(tmp_path, skew(), load="added_mass, normal: 1"))
    save_robot(robot, tmp_path / "robot.yaml")
    (tmp_path / "hull.stl").unlink()
    text = (tmp_path / "robot.yaml").read_text().replace("kind: added_mass", "kind: mesh_added_mass")
    (tmp_path / "robot.yaml").write_text(text.replace("normal: 1", "panels: 400"))
    with pytest.raises(InputError, match=r"is computed from its file, and hull.stl: cannot be read") as caught:
        load_robot(tmp_path / "robot.yaml")
    assert caught.value.field == "body.loads.water.kind"


def test_another_mesh_is_not_served_what_was_computed(tmp_path, without_capytaine):
    """Added mass goes with the cube of the size, added inertia with its fifth power."""
    save_robot(load_robot(written(tmp_path, spheroid())), tmp_path / "robot.yaml")
    before = added(load_robot(tmp_path / "robot.yaml"))
    spheroid(2.0).export(tmp_path / "hull.stl")
    after = added(load_robot(tmp_path / "robot.yaml"))
    assert np.diag(after)[1:] == pytest.approx([32, 32, 8, 8, 8] * np.diag(before)[1:], rel=0.02)
    without_capytaine()
    with pytest.raises(InputError, match=r"pip install 'nectosome\[mesh\]'") as caught:
        load_robot(tmp_path / "robot.yaml")
    assert caught.value.field == "body.loads.water.kind"


@pytest.mark.parametrize(
    ("old", "new"), [("panels: 100", "panels: 120"), ("hull.stl\n    unit: mm", "hull.stl\n    unit: cm")]
)
def test_a_word_that_people_change_is_followed(tmp_path, old, new):
    path = written(tmp_path, spheroid(), load="mesh_added_mass, panels: 100")
    save_robot(load_robot(path), path)
    before = added(load_robot(path))
    text = path.read_text()
    assert old in text
    path.write_text(text.replace(old, new, 1))
    after = added(load_robot(path))
    assert not np.array_equal(after, before)
    assert after[3, 3] == pytest.approx(before[3, 3] * (1000 if "unit" in old else 1), rel=0.05)


def test_text_of_another_mesh_than_the_one_there_is_refused(tmp_path, monkeypatch):
    robot = load_robot(written(tmp_path, spheroid(), load="added_mass, normal: 1"))
    spheroid(2.0).export(tmp_path / "hull.stl")
    monkeypatch.chdir(tmp_path)
    text = dump_robot(robot).replace("kind: added_mass", "kind: mesh_added_mass").replace("normal: 1", "panels: 100")
    with pytest.raises(InputError, match=r"hull\.stl: has changed since it was measured"):
        parse_robot(text)


def test_a_matrix_by_which_motions_have_negative_energies_is_refused(tmp_path):
    path = written(tmp_path, spheroid(), load="mesh_added_mass, panels: 100")
    robot = load_robot(path)
    assert robot.body is not None
    load = robot.body.loads["water"]
    assert isinstance(load, described.MeshAddedMassLoad)
    rows = np.array(load.known.matrix)
    bad = load.known.model_copy(update={"matrix": tuple(map(tuple, (-rows).tolist()))})
    loads = {"water": load.model_copy(update={"computed": bad})}
    save_robot(robot.with_part("body", loads=loads), path)
    with pytest.raises(InputError, match=r"takes energy in every direction.*Take `computed` out"):
        load_robot(path)

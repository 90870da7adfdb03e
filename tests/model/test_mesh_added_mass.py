"""Added mass of parts that are meshes: closed forms, mirror images, what goes along with a robot and what does not."""

import sys
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import trimesh

from nectosome.description import Rigid, RobotDescription, dump_robot, load_robot, parse_robot, save_robot, with_values
from nectosome.description import mesh_added_mass as described
from nectosome.description.plausible import implausible
from nectosome.geometry import panel_added_mass as panels
from nectosome.model import build
from nectosome.robots import describe
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

    slope = np.asarray(jax.jit(jax.jacfwd(carried))(1025.0))
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


SIDES = {"floor": (1, 3 / 8), "slow_surface": (1, 3 / 8), "fast_surface": (-1, 3 / 8)}


@pytest.mark.parametrize("near", SIDES)
def test_near_a_floor_and_a_surface_a_ball_carries_what_its_image_says(tmp_path, near):
    """Of a ball of radius a at the height h: 1/2 (1 +- 3/8 (a/h)^3) across, 3/16 along (Lamb 1932, art. 137), + of a
    wall. The next term is that of the sixth power, 0.1 %. Its centre is not at the origin of the mesh."""
    ball = trimesh.creation.icosphere(4, radius=50)
    ball.vertices += [100, 20, -10]
    load = f"mesh_added_mass, panels: 1500, near: {near}, height: 150 mm"
    found = np.diag(added(load_robot(written(tmp_path, ball, load))))[3:]
    sign, share = SIDES[near][0], SIDES[near][1] / 27
    half = 0.5 * 1025 * ball.volume * 1e-9
    assert found == pytest.approx(half * np.array([1 + sign * share / 2] * 2 + [1 + sign * share]), rel=0.004)
    assert (found / half - 1)[2] == pytest.approx(sign * share, rel=0.25)


def test_what_was_computed_near_a_floor_is_kept_with_its_height(tmp_path, without_capytaine):
    """A lower height adds mass; one that was not computed needs the mesh and the extra again."""
    path = written(tmp_path, skew(), "mesh_added_mass, panels: 200, near: floor, height: 60 mm")
    robot = load_robot(path)
    save_robot(robot, path)
    assert load_robot(path) == robot
    text = path.read_text()
    assert text.count("height: 60 mm") == 1
    path.write_text(text.replace("height: 60 mm", "height: 55 mm"))
    assert added(load_robot(path))[5, 5] > 1.01 * added(robot)[5, 5]
    path.write_text(text.replace("near: floor\n", "near: slow_surface\n", 1))
    without_capytaine()
    with pytest.raises(InputError, match=r"pip install 'nectosome\[mesh\]'"):
        load_robot(path)


@pytest.mark.parametrize(
    ("load", "field", "why"),
    [
        ("near: floor", "height", r"is missing\. Say how far the centre of the part's volume"),
        ("height: 1 m", "height", r"is that over a floor or below a surface\. Say which in near"),
        ("near: floor, height: 30 mm", "height", r"must be more than 40 mm: the part reaches so far below its centre"),
        ("near: surface, height: 1 m", "near", r"Did you mean .slow_surface"),
    ],
)
def test_what_is_no_place_near_a_floor_or_surface_is_refused(tmp_path, load, field, why):
    with pytest.raises(InputError, match=why) as caught:
        load_robot(written(tmp_path, spheroid(), f"mesh_added_mass, panels: 100, {load}"))
    assert caught.value.field == f"body.loads.water.{field}"


def test_the_floor_is_not_counted_twice(tmp_path):
    """Drag near the floor is another thing."""
    load = "mesh_added_mass, panels: 100, near: floor, height: 50 mm}, floor: {kind: near_floor, full: 0.1 m, none: 1 m"
    path = written(tmp_path, spheroid(), f"{load}, drag_area: [1 cm2, 1 cm2, 1 cm2]")
    save_robot(load_robot(path), tmp_path / "saved.yaml")
    saved = (tmp_path / "saved.yaml").read_text()
    (tmp_path / "saved.yaml").write_text(
        saved.replace("kind: near_floor", "kind: near_floor\n      mass: [1 g, 1 g, 1 g]")
    )
    for file in (written(tmp_path, spheroid(), f"{load}, mass: [1 g, 1 g, 1 g]"), tmp_path / "saved.yaml"):
        with pytest.raises(InputError, match=r"floor, a near_floor, adds the floor's added mass as well") as caught:
            load_robot(file)
        assert caught.value.field == "body.loads.water.near"


def test_settings_find_the_mesh_beside_the_robot_file(tmp_path, monkeypatch):
    """From any folder."""
    path = written(tmp_path, spheroid(), "mesh_added_mass, panels: 100, near: floor, height: 50 mm")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    robot = describe(path, ["body.loads.water.height=45mm", "body.loads.water.panels=120"])
    assert isinstance(robot.body, Rigid)
    known = robot.body.loads["water"].known
    assert (known.height, known.panels) == (0.045, 120)
    assert added(robot)[5, 5] > added(load_robot(path))[5, 5]


def test_the_height_does_not_vary(tmp_path):
    """Its matrix would stay that of the height before."""
    robot = load_robot(written(tmp_path, spheroid(), "mesh_added_mass, panels: 100, near: floor, height: 50 mm"))
    with pytest.raises(InputError, match=r"does not vary: what follows from it is computed when the file is read"):
        with_values(robot, {"body.loads.water.height": 0.1})


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


def test_bodies_that_touch_have_neither_added_mass_nor_a_shell(tmp_path):
    """Faces between them would count as wetted."""
    one = trimesh.creation.box((100.0, 50.0, 50.0))
    both = trimesh.util.concatenate([one, one.subdivide().apply_translation([100, 0, 0])])
    file = written(tmp_path, both)
    with pytest.raises(InputError, match=r"bodies in it touch or overlap.*Unite them") as error:
        load_robot(file)
    assert "body.loads.water.kind" in str(error.value)
    file.write_text(file.read_text().replace("mm}", "mm, thickness: 1 mm}"))
    with pytest.raises(InputError, match=r"bodies in the mesh touch or overlap.*inner walls"):
        load_robot(file)


def test_a_part_too_thin_for_its_panels_is_told_how_many_it_needs(tmp_path):
    """t = 2 V/A >= s/2 with A = n s^2 sqrt(3)/4."""
    a, t = 100.0, 4.0
    mean = 2 * a * a * t / (2 * a * a + 4 * a * t)
    needed = int(np.ceil((2 * a * a + 4 * a * t) * 4 / np.sqrt(3) / (2 * mean) ** 2))
    plate = trimesh.creation.box((a, a, t))
    (path, told), *_ = implausible(load_robot(written(tmp_path, plate, "mesh_added_mass, panels: 200")))
    assert path == "body.loads.water"
    assert told.endswith(f"give panels: {needed}")
    assert not list(implausible(load_robot(written(tmp_path, plate, f"mesh_added_mass, panels: {needed}"))))

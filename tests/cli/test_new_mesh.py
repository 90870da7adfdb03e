"""`nectosome new part.stl`: a robot file of a free body with that shape; what `show` tells of it."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from nectosome.cli.new import MESHES
from nectosome.description import Rigid, load_robot, with_values
from nectosome.geometry import SUFFIXES
from nectosome.io import load_dataset
from nectosome.model import build
from nectosome.solve import simulate

PART = trimesh.creation.box((300.0, 40.0, 50.0))
GUESS = "the drag is a first guess by the part's form. Measured motions refine it: nectosome identify\n"


@pytest.fixture(autouse=True)
def without_the_extra(monkeypatch):
    """So that added mass is computed only where a test takes it away."""
    monkeypatch.setitem(sys.modules, "capytaine", None)


def test_a_robot_comes_from_a_mesh(nectosome):
    Path("parts").mkdir()
    PART.export("parts/my hull.stl")
    answer = nectosome("new", "parts/my hull.stl", "--unit", "mm")
    assert (answer.code, answer.out) == (0, "")
    written = "my hull.yaml, my hull.stl. See nectosome show 'my hull.yaml', nectosome simulate 'my hull.yaml'."
    missing = "added mass is left out: it needs the package capytaine: pip install 'nectosome[mesh]'\n"
    assert answer.err == f"{missing}{GUESS}wrote {written}\n"
    robot = load_robot("my hull.yaml")
    assert (robot.name, robot.body.joint.kind) == ("my hull", "free")
    assert list(robot.aliases) == ["rho", "S_x", "S_y", "S_z"]  # sliders of the studio
    shown = nectosome("show", "my hull.yaml", "--json")
    found = json.loads(shown.out)
    assert found["values"]["mass"]["value"] == pytest.approx(0.6, rel=1e-6)
    assert found["values"]["displaced"]["value"] == pytest.approx(0.6, rel=1e-6)
    told = {row["what"]: row for row in found["tables"]["meshes"]}
    assert told["volume"]["value"]["value"] == pytest.approx(6e-4, rel=1e-6)
    assert told["projected"]["x"]["value"] == pytest.approx(2e-3, rel=1e-6)
    text = nectosome("show", "my hull.yaml").out
    assert "300 mm x 40 mm x 50 mm" in text
    assert "none: it is neutral" in text


def test_a_part_with_a_cavity_is_neutral_as_well(nectosome):
    hollow = trimesh.creation.box((280.0, 30.0, 40.0))
    hollow.invert()
    trimesh.util.concatenate([PART, hollow]).export("hull.ply")
    answer = nectosome("new", "hull.ply", "--unit", "mm")
    assert "hull.ply: closed cavities, without matter and without water: 1\n" in answer.err
    assert "none: it is neutral" in nectosome("show", "hull.yaml").out
    assert "closed cavities" in nectosome("check", "hull.yaml").err


def test_bodies_that_touch_come_without_added_mass(nectosome):
    trimesh.util.concatenate([PART, PART.subdivide().apply_translation([300, 0, 0])]).export("hull.stl")
    answer = nectosome("new", "hull.stl", "--unit", "mm")
    assert "added mass is left out: bodies touch or overlap. Unite them where they were drawn\n" in answer.err
    assert not [name for name in load_robot("hull.yaml").body.loads if name != "drag"]


def test_a_mesh_needs_a_unit_and_says_what_each_would_make_of_it(nectosome):
    PART.export("hull.stl")
    answer = nectosome("new", "hull.stl")
    assert answer.code == 2
    assert "300 mm with --unit mm, 7.62 m with --unit in, 300 m with --unit m" in answer.err
    assert nectosome("new", "hull.stl", "--unit", "km").code == 2
    assert nectosome("new", "turtle", "--unit", "mm").code == 2
    Path("bad.stl").write_text("no mesh")
    assert nectosome("new", "bad.stl", "--unit", "mm").err.startswith("bad.stl: is no STL file")
    for unit, size in (("m", "300 m"), ("ft", "91.44 m")):
        answer = nectosome("new", "hull.stl", "--unit", unit, "--force")
        assert (answer.code, answer.out) == (2, "")
        assert f"--unit: the largest extent of the part would be {size}. It is 300 mm with --unit mm" in answer.err
    assert {path.name for path in Path().iterdir()} == {"hull.stl", "bad.stl"}


def test_a_part_of_an_unlikely_size_is_asked_about_and_one_of_kilometres_refused(nectosome):
    PART.export("hull.stl")
    nectosome("new", "hull.stl", "--unit", "mm")
    small = Path("hull.yaml").read_text()
    Path("hull.yaml").write_text(small.replace("unit: mm", "unit: m"))
    assert "its largest extent is 300 m: check the unit, m" in nectosome("check", "hull.yaml").err
    PART.copy().apply_scale(10).export("hull.stl")
    answer = nectosome("check", "hull.yaml")
    assert answer.code == 2
    assert "body.shape.unit: in m the mesh is 3 km large. Check its unit." in answer.err


def test_the_file_has_the_drag_that_show_guesses(nectosome):
    PART.export("hull.stl")
    nectosome("new", "hull.stl", "--unit", "mm")
    rows = json.loads(nectosome("show", "hull.yaml", "--json").out)["tables"]["meshes"]
    guessed = next(row for row in rows if row["what"] == "guessed_drag_area")
    body = load_robot("hull.yaml").body
    assert isinstance(body, Rigid)
    assert list(body.loads) == ["drag"]
    assert body.loads["drag"].drag_area == pytest.approx([guessed[axis]["value"] for axis in "xyz"], rel=0.05)
    assert "a first guess" in Path("hull.yaml").read_text()


def test_with_the_extra_the_file_has_the_added_mass_of_the_mesh(nectosome, monkeypatch):
    monkeypatch.delitem(sys.modules, "capytaine")
    pytest.importorskip("capytaine")
    PART.export("hull.stl")
    assert nectosome("new", "hull.stl", "--unit", "mm").err.startswith(GUESS)
    body = load_robot("hull.yaml").body
    assert isinstance(body, Rigid)
    assert [load.kind for load in body.loads.values()] == ["mesh_added_mass", "lumped_drag"]


@pytest.mark.slow
def test_a_drop_of_the_part_tells_its_drag(nectosome):
    """As the documentation has it: readings with noise of 2 mm of a part that sinks, its drag 30 % below the guess."""
    PART.export("hull.stl")
    nectosome("new", "hull.stl", "--unit", "mm")
    text = Path("hull.yaml").read_text()
    Path("hull.yaml").write_text(text.replace("density: 1000 kg/m3", "density: 1100 kg/m3"))
    path = "body.loads.drag.drag_area.2"
    robot = load_robot("hull.yaml")
    assert isinstance(robot.body, Rigid)
    guess = robot.body.loads["drag"].drag_area[2]
    truth = 0.7 * guess
    run = simulate(build(with_values(robot, {path: truth})), 2.0, samples=41).to_dataset()
    depth = run["position"].values[:, 0, 2] + 2e-3 * np.random.default_rng(1).normal(size=41)
    np.savetxt("drop.csv", np.c_[run["time"].values, depth], "%.5f", ",", header="time (s),depth (m)", comments="")
    Path("campaign.yaml").write_text("recordings: [{file: drop.csv}]\n")
    vary = f"{path}={guess / 5}..{5 * guess} m2 log"
    options = ["--campaign", "campaign.yaml", "--compare", "depth=position.z", "--vary", vary, "--starts", "1"]
    answer = nectosome("identify", "hull.yaml", *options, "--write", "tuned.yaml", "--save", "found.nc")
    assert (answer.code, answer.err) == (0, "")
    found = load_dataset("found.nc")
    low, value, high = (found[name].values[0] for name in ("low", "value", "high"))
    assert low < truth < high < guess
    assert high - low < 0.05 * truth
    tuned = load_robot("tuned.yaml").body
    assert isinstance(tuned, Rigid)
    assert tuned.loads["drag"].drag_area[2] == pytest.approx(value, rel=1e-12)


def test_files_of_meshes_are_known_by_their_endings():
    assert MESHES == SUFFIXES

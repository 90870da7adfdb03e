"""`nectosome new part.stl`: a robot file of a free body with that shape; what `show` tells of it."""

import json
from pathlib import Path

import pytest
import trimesh

from nectosome.cli.new import MESHES
from nectosome.description import load_robot
from nectosome.geometry import SUFFIXES

PART = trimesh.creation.box((300.0, 40.0, 50.0))


def test_a_robot_comes_from_a_mesh(nectosome):
    Path("parts").mkdir()
    PART.export("parts/my hull.stl")
    answer = nectosome("new", "parts/my hull.stl", "--unit", "mm")
    assert (answer.code, answer.out) == (0, "")
    written = "my hull.yaml, my hull.stl. See nectosome show my hull.yaml, nectosome simulate my hull.yaml."
    assert answer.err == f"wrote {written}\n"
    robot = load_robot("my hull.yaml")
    assert (robot.name, robot.body.joint.kind) == ("my hull", "free")
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


def test_a_mesh_needs_a_unit_and_says_what_each_would_make_of_it(nectosome):
    PART.export("hull.stl")
    answer = nectosome("new", "hull.stl")
    assert answer.code == 2
    assert "300 mm with --unit mm, 7.62 m with --unit in, 300 m with --unit m" in answer.err
    assert nectosome("new", "hull.stl", "--unit", "km").code == 2
    assert nectosome("new", "turtle", "--unit", "mm").code == 2
    Path("bad.stl").write_text("no mesh")
    assert nectosome("new", "bad.stl", "--unit", "mm").err.startswith("bad.stl: is no STL file")
    assert {path.name for path in Path().iterdir()} == {"hull.stl", "bad.stl"}
    answer = nectosome("new", "hull.stl", "--unit", "m")
    assert "its largest extent is 300 m: check the unit, m" in answer.err
    assert "check the unit, m" in nectosome("show", "hull.yaml").err + nectosome("check", "hull.yaml").err


def test_files_of_meshes_are_known_by_their_endings():
    assert MESHES == SUFFIXES

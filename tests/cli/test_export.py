"""`nectosome export`: files of other programs, and what is no robot, no format, or in the way."""

import json
import math
import shutil
import sys
from pathlib import Path

import fmpy
import jax
import mujoco
import numpy as np
import pandas as pd
import pytest
import trimesh

from nectosome.cli.exports import FORMATS
from nectosome.description import load_robot, with_values
from nectosome.model import build

HULL = """
name: hull
body:
  kind: rigid
  shape: {mesh: meshes/hull.stl, unit: mm}
  density: 1100 kg/m3
  joint: {kind: free}
limbs:
  left:
    kind: rigid
    shape: {mesh: meshes/hull.stl, unit: mm, mirrored: true}
    mass: 20 g
    offset: [0 m, 100 mm, 0 m]
  fin:
    kind: rigid
    shape: {drawing: fin.svg, unit: mm, thickness: 3 mm}
    density: 1000 kg/m3
    joint: {kind: revolute, axis: z, motion: {kind: recording, file: turns.csv, column: angle}}
"""
SVG = '<svg xmlns="http://www.w3.org/2000/svg"><path d="M 0 0 L 60 0 L 60 -40 L 0 -20 Z"/></svg>'


@pytest.fixture
def hull(tmp_path):
    folder = tmp_path / "own"
    (folder / "meshes").mkdir(parents=True)
    trimesh.creation.capsule(300.0, 40.0).export(folder / "meshes" / "hull.stl")
    (folder / "fin.svg").write_text(SVG)
    (folder / "turns.csv").write_text("time (s),angle (deg)\n0,0\n0.5,10\n0.8,7\n1,0\n")
    (folder / "hull.yaml").write_text(HULL)
    return folder / "hull.yaml"


def test_a_robot_moves_as_a_folder(nectosome, hull):
    before = load_robot(hull)
    answer = nectosome("export", str(hull), "--to", "folder", "moved")
    assert (answer.code, answer.err) == (0, "")
    assert answer.out == "written: moved/hull.yaml, moved/meshes/hull.stl\n"
    assert Path("moved/meshes/hull.stl").read_bytes() == (hull.parent / "meshes" / "hull.stl").read_bytes()
    shutil.rmtree(hull.parent)
    shutil.move("moved", "elsewhere")
    after = load_robot("elsewhere/hull.yaml")
    assert after == before
    same = jax.tree.map(lambda a, b: np.array_equal(a, b), *map(jax.tree.leaves, (build(before), build(after))))
    assert all(same) and len(same) > 10


def test_a_robot_whose_mesh_is_gone_is_whole_without_it(nectosome, hull):
    text = hull.read_text().replace(HULL, "")
    assert text == ""
    assert nectosome("export", str(hull), "--to", "folder", "first").code == 0
    Path("first/meshes/hull.stl").unlink()
    answer = nectosome("export", "first/hull.yaml", "--to", "folder", "second")
    assert answer.code == 0
    assert answer.err.startswith("not in the folder, and not needed: meshes/hull.stl: ")
    assert load_robot("second/hull.yaml") == load_robot(hull)


def test_settings_are_in_the_folder(nectosome, hull):
    assert nectosome("export", str(hull), "--to", "folder", "moved", "--set", "limbs.left.mass=30g").code == 0
    assert load_robot("moved/hull.yaml") == with_values(load_robot(hull), {"limbs.left.mass": 0.03})


def test_nothing_is_overwritten_unasked(nectosome, hull, ball_run):
    assert nectosome("export", str(hull), "--to", "folder", "moved").code == 0
    Path("moved/hull.yaml").write_text("mine")
    answer = nectosome("export", str(hull), "--to", "folder", "moved")
    assert (answer.code, answer.err) == (
        2,
        "FILE: moved exists. Give another name, or --force to overwrite files in it.\n",
    )
    assert Path("moved/hull.yaml").read_text() == "mine"
    assert nectosome("export", str(hull), "--to", "folder", "moved", "--force").code == 0
    assert load_robot("moved/hull.yaml") == load_robot(hull)
    Path("run.csv").write_text("mine")
    assert "run.csv exists" in nectosome("export", str(ball_run), "--to", "csv", "run.csv").err
    assert Path("run.csv").read_text() == "mine"


def test_what_is_no_run_is_told_before_a_file_in_the_way(nectosome, ball):
    Path("ball.csv").write_text("mine")
    answer = nectosome("export", str(ball), "--to", "csv")
    assert answer.err.startswith(f"{ball}: is no saved run.")


def test_masses_are_a_table_of_a_robot_or_of_the_robot_of_a_run(nectosome, ball_run, ball):
    assert nectosome("export", str(ball), "--to", "masses").out == "written: ball_masses.csv\n"
    found = pd.read_csv("ball_masses.csv", index_col="part")
    assert found.loc["body", "mass (kg)"] == pytest.approx(1200 * 4 / 3 * np.pi * 0.02**3, rel=1e-12)
    assert found.loc["whole", "volume (m3)"] == pytest.approx(4 / 3 * np.pi * 0.02**3, rel=1e-12)
    assert "added_mass x x (kg)" in found and "inertia z z (kg m2)" in found
    assert nectosome("export", str(ball_run), "--to", "masses", "of_run.csv").code == 0
    assert Path("of_run.csv").read_text() == Path("ball_masses.csv").read_text()


def test_a_run_is_a_table(nectosome, ball_run):
    assert nectosome("export", str(ball_run), "--to", "csv").out == "written: ball.csv\n"
    answer = nectosome("measure", "ball.csv")
    assert "ball.csv: text, 21 rows, 0 to 2 s" in answer.out
    assert " or m" not in answer.out


def test_a_robot_with_a_mesh_is_a_urdf_that_reads_back(nectosome, hull):
    """The mesh and its volume come along; what cannot be said is told, line by line."""
    answer = nectosome("export", str(hull), "--to", "urdf", "out/hull.urdf")
    assert answer.err == "FILE: cannot write into out: No such file or directory.\n"
    Path("out").mkdir()
    answer = nectosome("export", str(hull), "--to", "urdf", "out/hull.urdf")
    assert (answer.code, answer.out) == (0, "written: out/hull.urdf, out/meshes/hull.stl\n")
    assert "left out: fin.angle: motion that drives it\n" in answer.err
    shutil.rmtree(hull.parent)
    assert nectosome("new", "out/hull.urdf", "again.yaml").code == 0
    again = load_robot("again.yaml")
    assert again.limbs["body_shape"].shape.numbers.volume == pytest.approx(capsule_volume(), rel=1e-2)
    assert again.limbs["fin"].mass == pytest.approx(1000 * 0.003 * 0.06 * 0.03, rel=1e-12)


def capsule_volume():
    return math.pi * 0.04**2 * 0.3 + 4 / 3 * math.pi * 0.04**3


@pytest.mark.parametrize(
    ("argv", "why"),
    [
        (("turtle", "--to", "stl"), f'--to: "stl" is none of {", ".join(FORMATS)}.'),
        (("turtle", "--to", "csv"), "turtle: is no saved run. Save one: nectosome simulate ROBOT --save run.nc"),
        (("nothing.yaml", "--to", "masses"), "nothing.yaml"),
        (("turtle", "--to", "urdf", "--time", "2s"), "--time: is for --to mjcf. Leave it out.\n"),
        (("turtle", "--to", "mjcf", "--step", "2ms"), "--step: is for --to fmu. Leave it out.\n"),
        (("turtle", "--to", "fmu", "--command", "none"), 'there is no quantity called "none" in'),
        (("turtle",), "export: --to needs a value. See nectosome export --help."),
        (("turtle", "--to", "masses", "a.txt"), 'FILE: "a.txt" does not end in .csv.'),
        (("turtle", "--to", "folder", "no/where"), "FILE: cannot write into no"),
    ],
)
def test_mistakes_are_a_sentence(nectosome, argv, why):
    answer = nectosome("export", *argv)
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith(why) and answer.err.count("\n") == 1


def test_a_model_of_mujoco_tells_how_far_off_it_is(nectosome, ball):
    """A ball that sinks: its drag has the form of MuJoCo's, so that the mean velocities are the same."""
    answer = nectosome("export", str(ball), "--to", "mjcf", "--time", "1s", "--json")
    found = json.loads(answer.out)
    ours, theirs = (row["z"]["value"] for row in found["tables"]["velocity"].values())
    assert theirs == pytest.approx(ours, rel=5e-3)
    assert found["files"] == ["ball.xml"]
    assert found["values"]["missed"]["value"] < 0.02
    assert mujoco.MjModel.from_xml_path("ball.xml").nv == 1


def test_a_model_of_a_driven_robot_has_its_controls_beside_it(nectosome, ball, monkeypatch):
    driven = ball.read_text().replace("axis: z}", "axis: z, motion: {kind: sine, amplitude: 10 mm, frequency: 1 Hz}}")
    ball.write_text(driven)
    answer = nectosome("export", str(ball), "--to", "mjcf", "--time", "0.5s")
    assert answer.out.endswith("written: ball.xml, ball_controls.csv\n")
    assert "means:" not in answer.out  # a motion prescribes it
    found = pd.read_csv("ball_controls.csv")
    np.testing.assert_allclose(found["body.position"], 0.01 * np.sin(2 * np.pi * found["time (s)"]), atol=1e-15)
    Path("ball.xml").unlink()
    monkeypatch.setattr("nectosome.solve.simulate", None)  # nothing is computed before names are checked
    answer = nectosome("export", str(ball), "--to", "mjcf")
    assert answer.err == "FILE: ball_controls.csv exists. Give another name, or --force to overwrite it.\n"
    assert not Path("ball.xml").exists()


def test_a_model_that_nothing_drives_is_told_and_its_speed_is_not_compared(nectosome, ball):
    driven = ball.read_text().replace("loads:", "loads:\n    push: {kind: force, force: [0 N, 0 N, 1 N]}")
    ball.write_text(driven)
    answer = nectosome("export", str(ball), "--to", "mjcf", "--time", "1s")
    assert "No drive is in the model. It lacks body: load push, force.\n" in answer.err
    assert "means:" not in answer.out
    assert "force of the water that MuJoCo misses, along the mean velocity: " in answer.out


def test_a_speed_that_still_changes_is_told(nectosome, ball):
    """A ball that has only begun to sink."""
    answer = nectosome("export", str(ball), "--to", "mjcf", "--time", "0.1s")
    assert "the speed here still changes by" in answer.err and "the speed in MuJoCo still changes by" in answer.err
    assert "give a longer --time.\n" in answer.err


def test_meshes_and_plates_are_in_the_model_of_mujoco(nectosome, hull):
    """By their simplified surfaces, the mirror image among them; mass and displaced water as in the robot."""
    assert nectosome("export", str(hull), "--to", "mjcf", "hull.xml", "--time", "0.2s").code == 0
    model = mujoco.MjModel.from_xml_path("hull.xml")
    assert model.nmesh == 2
    assert model.body_mass.sum() == pytest.approx(float(build(load_robot(hull)).weight().sum()), rel=1e-9)
    lifted = 1000 * (2 * load_robot(hull).body.shape.numbers.volume + 0.003 * 0.06 * 0.03)
    assert (model.body_mass * model.body_gravcomp).sum() == pytest.approx(lifted, rel=1e-9)


@pytest.mark.parametrize(("to", "package", "extra"), [("mjcf", "mujoco", "mujoco"), ("fmu", "pythonfmu", "fmu")])
def test_a_missing_package_is_told_with_the_command_that_installs_it(nectosome, ball, monkeypatch, to, package, extra):
    monkeypatch.setitem(sys.modules, package, None)
    answer = nectosome("export", str(ball), "--to", to)
    assert (answer.code, answer.err) == (2, f"the package {package} is missing: pip install 'nectosome[{extra}]'.\n")
    assert {path.name for path in Path().iterdir()} == {"ball.yaml"}


def test_an_fmu_has_inputs_and_outputs_by_name(nectosome, ball):
    argv = ("--to", "fmu", "--command", "body.loads.drag.drag_area.2", "--measure", "body.velocity.z", "--step", "50ms")
    assert nectosome("export", str(ball), *argv).out == "written: ball.fmu\n"
    found = fmpy.read_model_description("ball.fmu", validate=True)
    assert [(v.name, v.causality) for v in found.modelVariables] == [
        ("body.loads.drag.drag_area.2", "input"), ("solver.rtol", "parameter"), ("solver.atol", "parameter"),
        ("body.velocity.z", "output")]  # fmt: skip
    assert nectosome("export", str(ball), "--to", "fmu", "--force").code == 0
    names = [v.name for v in fmpy.read_model_description("ball.fmu").modelVariables]
    assert names[2:] == ["body.position.x", "body.position.y", "body.position.z", "body.heading"]
    answer = nectosome("export", str(ball), "--to", "fmu", "--measure", "nothing", "--force")
    assert (answer.code, answer.err.count("\n")) == (2, 1)


def test_a_run_keeps_its_numbers(nectosome, ball_run):
    answer = nectosome("export", str(ball_run), "--to", "csv", "--set", "body.density=1000kg/m3")
    assert (answer.code, answer.err) == (2, "--set: is for a robot: a run is what it was. Leave it out.\n")

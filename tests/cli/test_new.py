"""Files to start from: each runs as it is, editors find its schema, and none is written over what is there."""

from pathlib import Path

import pytest
import trimesh

from nectosome.cli.schema import schema_text
from nectosome.description import load_robot
from nectosome.description.mission import load_mission
from nectosome.designs import load_problem
from nectosome.identification.gait.files import load_gait_fit
from nectosome.io.schema.kinds import KINDS, kind_of_file
from nectosome.io.yaml_text import read_yaml
from nectosome.rigs.loops_file import load_loops
from nectosome.rigs.rig_file import load_rig
from nectosome.rigs.run_plan import load_plan
from nectosome.robots import describe
from nectosome.robots.shipped import file_names, starter_names, starter_of
from nectosome.vision.video import load_sheet

URDF = """<robot name="arm"><link name="base"/>
<link name="tip"><inertial><mass value="0.5"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="tip"/>
<limit lower="-1" upper="1"/></joint></robot>
"""


OTHERS = ("campaign", "gaits", "loops", "markers", "mission", "plan", "problem", "rig", "segments", "sheet")


def test_all_are_listed_with_what_they_are(nectosome):
    answer = nectosome("new")
    assert (answer.code, answer.err) == (0, "")
    robots, others = answer.out.split("\n\n")[:2]
    listed = [
        [line.split()[0] for line in part.splitlines()[1:] if not line.startswith(" ")] for part in (robots, others)
    ]
    assert listed == [[*starter_names(), "beetle", "beetle1", "beetle_free", "flagella4", "paddle2"], [*OTHERS]]
    assert "A stiff body with a soft tail that a servo swings" in robots
    assert "a design problem: nectosome design ROBOT --problem FILE" in others


def test_there_is_a_template_for_every_kind_of_file():
    assert {*OTHERS, "robot"} == {*KINDS}


@pytest.mark.parametrize("name", starter_names())
def test_a_template_is_written_as_it_ships_with_its_schema_beside(nectosome, name):
    answer = nectosome("new", name)
    assert (answer.code, answer.out) == (0, "")
    first, _, rest = Path(f"{name}.yaml").read_text().partition("\n")
    assert first == "# yaml-language-server: $schema=robot.schema.json"
    assert rest == starter_of(name).read_text().partition("\n")[2]
    assert Path("robot.schema.json").read_text() == schema_text("robot")
    assert load_robot(f"{name}.yaml").about


@pytest.mark.parametrize("name", OTHERS)
def test_a_file_of_another_kind_is_written_with_what_it_reads_and_its_schema(nectosome, name):
    answer = nectosome("new", name, "mine.yaml")
    assert (answer.code, answer.out) == (0, "")
    recordings = {"campaign": {"run_1.csv", "run_2.csv"}, "sheet": {"run_1.csv"}}.get(name, set())
    assert {path.name for path in Path().iterdir()} == {"mine.yaml", f"{name}.schema.json", *recordings}
    text = Path("mine.yaml").read_text()
    assert text.startswith(f"# yaml-language-server: $schema={name}.schema.json\n#")
    assert kind_of_file(read_yaml(text, "mine.yaml")[0]) is KINDS[name]
    command = answer.err.partition("See ")[2]
    assert command.startswith("nectosome ") and " mine.yaml" in command


def test_a_campaign_and_a_sheet_read_their_recordings(nectosome):
    for name, argv in (
        ("campaign", ("--campaign", "campaign.yaml")),
        ("sheet", ("run_1.csv", "--config", "sheet.yaml")),
    ):
        assert nectosome("new", name).code == 0
        answer = nectosome("measure", *argv)
        assert (answer.code, answer.err) == (0, "")
        assert "run_1.csv: text, 201 rows, 0 to 4 s" in answer.out
        assert "force     Load cell" in answer.out


def test_the_files_of_other_kinds_fit_the_robots_that_they_are_for(nectosome):
    for name in OTHERS:
        nectosome("new", name)
    problem = load_problem("problem.yaml").task(describe("flagellum"))
    assert (problem.names, problem.objective) == (("L", "omega", "E"), "speed")
    assert [mode.name for mode in load_mission("mission.yaml", describe("beetle1")).modes] == ["begin", "row", "drift"]
    assert len(load_gait_fit("gaits.yaml").trials) == 2
    rig = load_rig("rig.yaml")
    assert rig.dt == 5e-3
    assert len(load_plan("plan.yaml", rig).runs) == 12
    assert [*load_loops("loops.yaml").tasks("eel")] == ["speed", "heading"]
    assert list(load_sheet("segments.yaml").segments) == ["arm", "first", "second", "third"]
    assert len(load_sheet("markers.yaml").points) == 6


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "argv", "said"),
    [
        ("problem", ("design", "flagellum", "--problem", "problem.yaml", "--starts", "1"), "at its limit: torque"),
        ("mission", ("simulate", "beetle1", "--mission", "mission.yaml"), "position.x > 30 cm"),
        ("gaits", ("identify", "gait", "--target", "gaits.yaml", "--evaluations", "6"), "reached"),
        ("rig", ("control", "rig", "--config", "rig.yaml", "--reference", "sine", "--amplitude", "6mm", "--frequency",
                 "0.04Hz", "--time", "25s"), "finished, 5001 samples"),
        ("loops", ("control", "loops", "eel", "loops.yaml"), "2 loops on simulated eel: finished, 161 samples"),
    ],
)  # fmt: skip
def test_a_file_of_another_kind_runs_as_it_is(nectosome, name, argv, said):
    assert nectosome("new", name).code == 0
    answer = nectosome(*argv)
    assert answer.code == 0, answer.err
    assert said in answer.out


@pytest.mark.parametrize("name", ["flagella2", "beetle", "paddle4"])
def test_a_robot_of_a_family_is_written_as_it_is_described(nectosome, name):
    assert nectosome("new", name, "mine.yaml").code == 0
    assert load_robot("mine.yaml") == describe(name)


# those with names of robots are built by `test_commands.py`
@pytest.mark.parametrize(
    "name",
    [pytest.param(n, marks=pytest.mark.slow) if n in file_names() else n for n in starter_names()],
)
def test_a_template_passes_the_check(nectosome, name):
    assert nectosome("new", name, "mine.yaml").code == 0
    assert "mine.yaml: ok" in nectosome("check", "mine.yaml").out


@pytest.mark.parametrize(
    "name", [name if name == "tail" else pytest.param(name, marks=pytest.mark.slow) for name in starter_names()]
)
def test_a_template_moves(nectosome, name):
    nectosome("new", name)
    answer = nectosome("simulate", f"{name}.yaml", "--time", "0.05s", "--samples", "3")
    is_paddle = name == "paddle"  # beyond the limits of its servo, with hinges as they were printed
    assert (answer.code, answer.err.count("\n")) == (is_paddle, is_paddle)
    assert ("joint.flexure.as_printed:" in answer.err) == is_paddle
    assert "SOLVED" in answer.out


@pytest.mark.parametrize(
    ("argv", "message"),
    [
        (["tial"], 'there is no template called "tial". Did you mean "tail"?'),
        (["flagella13"], "flagella: 13 flagella asked for; 1 to 12 fit on the ring."),
        (["tail", "mine.yaml"], "mine.yaml: exists. Give another name, or --force to overwrite it."),
        (["tail", "mine.txt"], 'FILE: "mine.txt" does not end in .yaml.'),
        (["tail", "none/mine.yaml"], "FILE: cannot write into none: No such file or directory."),
    ],
)
def test_what_is_not_written_is_told(nectosome, argv, message):
    Path("mine.yaml").write_text("mine")
    answer = nectosome("new", *argv)
    assert (answer.code, answer.out, answer.err) == (2, "", message + "\n")
    assert Path("mine.yaml").read_text() == "mine"
    assert [path.name for path in Path().iterdir()] == ["mine.yaml"]


def test_a_schema_that_is_there_is_left_alone(nectosome):
    nectosome("new", "tail")
    assert nectosome("new", "tail", "two.yaml").err.startswith("wrote two.yaml.")
    Path("robot.schema.json").write_text("mine")
    answer = nectosome("new", "tail", "three.yaml")
    assert answer.code == 0
    assert answer.err.startswith("left alone: robot.schema.json, which is not the schema of this version. Renew it: ")
    assert Path("robot.schema.json").read_text() == "mine"


def test_a_recording_that_is_there_is_not_overwritten(nectosome):
    Path("run_2.csv").write_text("mine")
    answer = nectosome("new", "campaign")
    assert (answer.code, answer.err) == (2, "run_2.csv: exists. Give another name, or --force to overwrite it.\n")
    assert [path.name for path in Path().iterdir()] == ["run_2.csv"]
    assert nectosome("new", "campaign", "--force").code == 0
    assert Path("run_2.csv").read_text() != "mine"


def test_a_robot_comes_from_a_urdf_file(nectosome):
    Path("arm.urdf").write_text(URDF)
    answer = nectosome("new", "arm.urdf", "mine.yaml")
    assert (answer.code, answer.out) == (0, "")
    assert answer.err == (
        'left out: joint hinge: limit lower="-1" upper="1"\n'
        "left out: link tip: no box, cylinder, sphere or mesh to be used, so it displaces no water\n"
        "wrote mine.yaml. See nectosome show mine.yaml, nectosome simulate mine.yaml.\n"
    )
    assert nectosome("check", "mine.yaml").out == "mine.yaml: ok, 2 parts, 1 degree of freedom, 0.5 kg\n"
    assert nectosome("new", "arm.urdf").code == 0
    assert Path("arm.yaml").read_text() == Path("mine.yaml").read_text()
    again = nectosome("new", "arm.urdf")
    assert (again.code, again.err) == (2, "arm.yaml: exists. Give another name, or --force to overwrite it.\n")
    Path("arm.yaml").write_text("")
    assert nectosome("new", "arm.urdf", "--force").code == 0
    assert Path("arm.yaml").read_text() == Path("mine.yaml").read_text()


def test_meshes_of_a_urdf_file_are_copied_beside_the_robot_file(nectosome):
    """So that what needs them, such as added mass by panels, finds them; nothing is overwritten."""
    Path("parts").mkdir()
    trimesh.creation.box((0.1, 0.2, 0.3)).export("parts/tip.stl")
    mesh = '<visual><geometry><mesh filename="parts/tip.stl"/></geometry></visual></link>\n<joint'
    Path("arm.urdf").write_text(URDF.replace("</link>\n<joint", mesh))
    Path("tip.stl").write_text("mine")
    refused = nectosome("new", "arm.urdf")
    assert (refused.code, "tip.stl: exists." in refused.err, Path("arm.yaml").exists()) == (2, True, False)
    Path("tip.stl").unlink()
    answer = nectosome("new", "arm.urdf")
    assert answer.code == 0
    assert "wrote arm.yaml, tip.stl." in answer.err
    shape = load_robot("arm.yaml").limbs["tip_shape"].shape
    assert Path(shape.mesh).read_bytes() == Path("parts/tip.stl").read_bytes()


def test_nothing_is_written_from_a_urdf_file_with_a_mistake(nectosome):
    Path("arm.urdf").write_text(URDF.replace("0.5", "-0.5"))
    answer = nectosome("new", "arm.urdf")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith('arm.urdf, link tip, inertial, mass: "-0.5" kg is no mass.')
    assert nectosome("new", "none.urdf").err == "none.urdf: cannot be read: No such file or directory.\n"
    assert [path.name for path in Path().iterdir()] == ["arm.urdf"]

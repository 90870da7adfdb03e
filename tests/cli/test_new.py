"""Files to start from: each is a robot that moves, and none is written over what is there."""

from pathlib import Path

import pytest

from nectosome.description import load_robot
from nectosome.robots import describe
from nectosome.robots.shipped import starter_names, starter_of

URDF = """<robot name="arm"><link name="base"/>
<link name="tip"><inertial><mass value="0.5"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="hinge" type="revolute"><parent link="base"/><child link="tip"/>
<limit lower="-1" upper="1"/></joint></robot>
"""


def test_all_are_listed_with_what_they_are(nectosome):
    answer = nectosome("new")
    assert (answer.code, answer.err) == (0, "")
    listed = [line.split()[0] for line in answer.out.partition("\n\n")[0].splitlines()[1:] if not line.startswith(" ")]
    assert listed == [*starter_names(), "beetle", "beetle1", "beetle_free", "flagella4", "paddle2"]
    assert "A stiff body with a soft tail that a servo swings" in answer.out


@pytest.mark.parametrize("name", starter_names())
def test_a_template_is_written_as_it_ships(nectosome, name):
    answer = nectosome("new", name)
    assert (answer.code, answer.out) == (0, "")
    assert Path(f"{name}.yaml").read_text() == starter_of(name).read_text()
    assert load_robot(f"{name}.yaml").about


@pytest.mark.parametrize("name", ["flagella2", "beetle", "paddle4"])
def test_a_robot_of_a_family_is_written_as_it_is_described(nectosome, name):
    assert nectosome("new", name, "mine.yaml").code == 0
    assert load_robot("mine.yaml") == describe(name)


@pytest.mark.parametrize("name", ["paddles", "ring", "tail"])
def test_a_template_passes_the_check(nectosome, name):
    assert nectosome("new", name, "mine.yaml").code == 0
    assert "mine.yaml: ok" in nectosome("check", "mine.yaml").out


@pytest.mark.parametrize(
    "name", [pytest.param("paddles", marks=pytest.mark.slow), pytest.param("ring", marks=pytest.mark.slow), "tail"]
)
def test_a_template_moves(nectosome, name):
    nectosome("new", name)
    answer = nectosome("simulate", f"{name}.yaml", "--time", "0.05s", "--samples", "3")
    assert (answer.code, answer.err) == (0, "")
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


def test_a_robot_comes_from_a_urdf_file(nectosome):
    Path("arm.urdf").write_text(URDF)
    answer = nectosome("new", "arm.urdf", "mine.yaml")
    assert (answer.code, answer.out) == (0, "")
    assert answer.err == (
        'left out: joint hinge: limit lower="-1" upper="1"\n'
        "left out: link tip: no box, cylinder or sphere, so it displaces no water\n"
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


def test_nothing_is_written_from_a_urdf_file_with_a_mistake(nectosome):
    Path("arm.urdf").write_text(URDF.replace("0.5", "-0.5"))
    answer = nectosome("new", "arm.urdf")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.startswith('arm.urdf, link tip, inertial, mass: "-0.5" kg is no mass.')
    assert nectosome("new", "none.urdf").err == "none.urdf: cannot be read: No such file or directory.\n"
    assert [path.name for path in Path().iterdir()] == ["arm.urdf"]

"""Files to start from: each is a robot that moves, and none is written over what is there."""

from pathlib import Path

import pytest

from nectosome.io import load_robot
from nectosome.robots.shipped import template_names, template_of


def test_all_are_listed_with_what_they_are(nectosome):
    answer = nectosome("new")
    assert (answer.code, answer.err) == (0, "")
    listed = [line.split()[0] for line in answer.out.splitlines()[1:] if not line.startswith(" ")]
    assert listed == template_names()
    assert "A stiff body with a soft tail that a servo swings" in answer.out


@pytest.mark.parametrize("name", template_names())
def test_a_template_is_written_as_it_ships(nectosome, name):
    answer = nectosome("new", name)
    assert (answer.code, answer.out) == (0, "")
    assert Path(f"{name}.yaml").read_text() == template_of(name).read_text()
    assert load_robot(f"{name}.yaml").about


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
        (["tail", "mine.yaml"], "mine.yaml: is there already, and is left as it is. Give another name."),
        (["tail", "mine.txt"], 'FILE: "mine.txt" does not end in .yaml, as what is written there would.'),
        (["tail", "none/mine.yaml"], "FILE: cannot write into none: No such file or directory."),
    ],
)
def test_what_is_not_written_is_told(nectosome, argv, message):
    Path("mine.yaml").write_text("mine")
    answer = nectosome("new", *argv)
    assert (answer.code, answer.out, answer.err) == (2, "", message + "\n")
    assert Path("mine.yaml").read_text() == "mine"
    assert [path.name for path in Path().iterdir()] == ["mine.yaml"]

"""What `import nectosome as ns` gives to those who work in a notebook."""

import re
from importlib import import_module
from pathlib import Path

import jax
import pytest

import nectosome as ns

BALL = """
name: ball
body:
  kind: rigid
  shape: spheroid
  length: 40 mm
  radius: 20 mm
  density: 1200 kg/m3
  joint: {kind: prismatic, axis: z}
  loads: {drag: {kind: lumped_drag, drag_area: [6 cm2, 6 cm2, 6 cm2]}}
aliases: {heavy: body.density}
"""


@pytest.fixture(scope="module")
def ball(tmp_path_factory):
    path = tmp_path_factory.mktemp("face") / "ball.yaml"
    path.write_text(BALL)
    return ns.describe(str(path))


def test_names_and_rooms_are_offered_and_come():
    assert {"simulate", "measure", "controllers", "identification"} <= set(dir(ns))
    assert all(getattr(ns, name) is not None for name in dir(ns))
    assert ns.measure is import_module("nectosome.measure")
    with pytest.raises(AttributeError, match=r"nectosome has no simulat$"):
        _ = ns.simulat


def test_the_page_lists_all_public_names_and_no_others():
    page = (Path(__file__).parents[2] / "docs" / "api.md").read_text(encoding="utf-8")
    face = page.partition("## The public face")[2].partition("\n## ")[0]
    listed = {path.rpartition(".")[::2][::-1] for path in re.findall(r"^::: (\S+)$", face, re.M)}
    assert {name for name, _ in listed} == set(ns.__all__)
    for name, module in listed:
        assert getattr(ns, name) is getattr(import_module(module), name)


def test_a_robot_with_other_numbers_is_saved_and_read_again(ball, tmp_path):
    other = ns.apply_settings(ball, ["heavy=1.3g/cm3"])
    ns.save_robot(other, tmp_path / "other.yaml")
    assert ns.load_robot(tmp_path / "other.yaml") == other != ball
    with pytest.raises(ns.InputError, match="it is a folder"):
        ns.save_robot(other, tmp_path)


def test_what_is_printed_is_one_line(ball):
    robot = ns.build(ball)
    run = ns.simulate(robot, 0.1, samples=3)
    assert repr(ball) == str(ball) == "<RobotDescription ball: parts body; short names heavy>"
    assert repr(robot) == "<Robot: parts body; 1 degrees of freedom, 0 driven>"
    assert repr(run) == "<Run: SOLVED, solved, 3 samples from 0 s to 0.1 s>"
    assert repr(run.value).startswith("<Trajectory: 3 samples from 0 s to 0.1 s, State(q=f64[3,1]")
    jax.jit(lambda run: repr(run) and run.status)(run)  # what is traced has a repr too

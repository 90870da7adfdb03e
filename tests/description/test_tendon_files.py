# ruff: noqa: E501  (tables: one case a line)
"""Tendons over joints in robot files: what is refused and why, copies of limbs, and that they read back."""

import pytest

from nectosome.description import dump_robot, get_value, numeric_paths, parse_robot, resolve
from nectosome.units import InputError

POINT = "kind: rigid, shape: point, mass: 1 kg, inertia: [1 g m2, 1 g m2, 1 g m2]"
TEXT = f"""
name: tendons
body: {{{POINT}}}
limbs:
  drum: {{{POINT}, joint: {{kind: revolute, axis: z, motion: {{kind: sine, amplitude: 1 rad, frequency: 1 Hz}}}}}}
  rack: {{{POINT}, joint: {{kind: prismatic, axis: x}}}}
  leaf: {{{POINT}, joint: {{kind: revolute, axis: z}}, loads: {{push: {{kind: force, force: [0, 0, 0]}}}}}}
  stem: {{on: leaf, {POINT}, joint: {{kind: revolute, axis: z}}}}
  ball: {{{POINT}, joint: {{kind: spherical}}}}
tendons:
  wound: {{over: {{leaf: 12 mm, stem: -8 mm}}, stiffness: 20 kN/m, pretension: 2 N, pulled_by: {{part: drum, radius: 10 mm}}}}
  cranked: {{over: {{leaf: -12 mm}}, stiffness: 20 kN/m, damping: 3 N s/m, slack: 1 mm, pulled_by: {{part: drum, crank: 10 mm, guide: 40 mm, angle: 90 deg}}}}
  drawn: {{over: {{stem: 9 mm}}, stiffness: 20 kN/m, pulled_by: {{part: rack, ratio: -2}}}}
  fixed: {{over: {{leaf: 5 mm, stem: 5 mm}}, stiffness: 20 kN/m}}
"""


@pytest.mark.parametrize(
    ("there", "instead", "message"),
    [
        ("stem: -8 mm", "sten: -8 mm", 'line 11, tendons.wound.over.sten: there is no part "sten". Did you mean "stem"?'),
        ("stem: -8 mm", "body: -8 mm", "tendons.wound.over.body: body has a fixed joint: tendons run over hinges. Leave the part out."),
        ("stem: -8 mm", "ball: -8 mm", "tendons.wound.over.ball: ball has a spherical joint: tendons run over hinges."),
        ("stem: -8 mm", "rack: -8 mm", "tendons.wound.over.rack: rack has a prismatic joint: tendons run over hinges."),
        ("stem: -8 mm", "stem: 0 mm", "tendons.wound.over.stem: the arm is 0: it does not act on this hinge. Leave the part out."),
        ("stem: -8 mm", "stem: -8 N", "tendons.wound.over.stem"),
        ("leaf: 12 mm, stem: -8 mm", "", "tendons.wound.over: at least 1 value expected, 0 given."),
        ("stem: -8 mm}, stiffness: 20 kN/m", "stem: -8 mm}", "tendons.wound.stiffness: is missing."),
        ("stem: -8 mm}, stiffness: 20 kN/m", "stem: -8 mm}, stiffness: 0 N/m", 'tendons.wound.stiffness: "0 N/m" is out of range'),
        ("pretension: 2 N", "pretension: -2 N", 'tendons.wound.pretension: "-2 N" is out of range'),
        ("pretension: 2 N", "pretension: 2 N, slack: 1 mm", "tendons.wound.slack: there is a pretension as well. Leave one of the two out."),
        ("{part: drum, radius: 10 mm}", "{part: drun, radius: 10 mm}", 'tendons.wound.pulled_by.part: there is no part "drun". Did you mean "drum"?'),
        ("{part: drum, radius: 10 mm}", "{part: leaf, radius: 10 mm}", "tendons.wound.pulled_by.part: the tendon runs over leaf already. Let another part pull it."),
        ("{part: drum, radius: 10 mm}", "{part: body, radius: 10 mm}", "tendons.wound.pulled_by.radius: goes with a hinge; body has a fixed joint. Hinges pull by a radius or a crank, slides by a ratio."),
        ("{part: drum, radius: 10 mm}", "{part: rack, radius: 10 mm}", "tendons.wound.pulled_by.radius: goes with a hinge; rack has a prismatic joint."),
        ("{part: rack, ratio: -2}", "{part: drum, ratio: -2}", "tendons.drawn.pulled_by.ratio: goes with a slide; drum has a revolute joint."),
        ("{part: drum, radius: 10 mm}", "{part: drum}", "tendons.wound.pulled_by.radius: is missing. Give the radius of a winch"),
        ("{part: drum, radius: 10 mm}", "{part: drum, radius: 0 mm}", "tendons.wound.pulled_by.radius: is 0, so that nothing is pulled."),
        ("{part: drum, radius: 10 mm}", "{part: drum, radius: 10 mm, ratio: 1}", "tendons.wound.pulled_by.ratio: there is a radius as well. Leave one of the two out."),
        ("{part: drum, radius: 10 mm}", "{part: drum, radius: 10 mm, guide: 40 mm}", "tendons.wound.pulled_by.guide: goes with a crank. Leave it out."),
        (", guide: 40 mm", "", "tendons.cranked.pulled_by.guide: is missing. Give the distance from the crank's axis to the tendon's guide."),
        (", guide: 40 mm", ", guide: 10 mm", "tendons.cranked.pulled_by.guide: must be more than the radius of the crank."),
        ("  fixed:", "  push:", "tendons.push: a load is called push too, and results tell them apart by name. Choose another name."),
        ("stiffness: 20 kN/m}\n", "stiffness: 20 kN/m, pull: 3 mm}\n", 'tendons.fixed.pull: there is no field "pull" here.'),
    ],
)  # fmt: skip
def test_a_tendon_that_does_not_fit_is_told(there, instead, message):
    assert there in TEXT
    with pytest.raises(InputError) as caught:
        parse_robot(TEXT.replace(there, instead), "robot.yaml")
    assert message in str(caught.value)
    assert "Error" not in str(caught.value)


def test_tendons_read_back_and_have_paths():
    robot = parse_robot(TEXT)
    assert parse_robot(dump_robot(robot)) == robot
    known = numeric_paths(robot)
    assert {"tendons.wound.over.stem", "tendons.cranked.pulled_by.guide", "tendons.fixed.softness"} <= set(known)
    assert get_value(robot, "tendons.wound.over.stem") == pytest.approx(-0.008)


FINGERS = f"""
name: hand
body: {{{POINT}}}
limbs:
  drum: {{{POINT}, joint: {{kind: revolute, axis: z}}}}
  finger: {{{POINT}, repeat: {{count: 3, around: x}}, joint: {{kind: revolute, axis: z}}}}
  tip: {{on: finger, {POINT}, joint: {{kind: revolute, axis: z}}}}
  toe: {{{POINT}, repeat: {{count: 2, around: x}}, joint: {{kind: revolute, axis: z}}}}
tendons:
  bend: {{over: {{finger: 12 mm, tip: -8 mm}}, stiffness: 20 kN/m, pulled_by: {{part: drum, radius: 10 mm}}}}
  one: {{over: {{tip2: 5 mm}}, stiffness: 20 kN/m}}
aliases: {{k: tendons.bend.stiffness, crossing: [tendons.bend.over.tip, tendons.one.over.tip2]}}
"""


def test_a_tendon_over_a_limb_that_comes_several_times_comes_as_often():
    robot = parse_robot(FINGERS)
    assert [*robot.tendons] == ["bend1", "bend2", "bend3", "one"]
    assert robot.tendons["bend2"].over == pytest.approx({"finger2": 0.012, "tip2": -0.008})
    assert {robot.tendons[f"bend{k}"].pulled_by.part for k in (1, 2, 3)} == {"drum"}
    assert resolve(robot, "k") == [f"tendons.bend{k}.stiffness" for k in (1, 2, 3)]
    assert resolve(robot, "crossing") == [*(f"tendons.bend{k}.over.tip{k}" for k in (1, 2, 3)), "tendons.one.over.tip2"]
    assert parse_robot(dump_robot(robot)) == robot


@pytest.mark.parametrize(
    ("there", "instead", "message"),
    [
        ("tip: -8 mm", "toe: -8 mm", "tendons.bend: toe comes 2 times, another of its parts 3 times, not on one another. Write a tendon for each copy, over toe1 and so on."),
        ("  one: {over: {tip2: 5 mm}", "  bend2: {over: {tip2: 5 mm}", "tendons.bend2: a copy of another tendon is called so. Choose another name."),
        ("k: tendons.bend.stiffness", "k: tendons.bend.stiffnes", 'aliases.k: "tendons.bend1.stiffnes" is no quantity of this robot.'),
    ],
)  # fmt: skip
def test_copies_that_do_not_fit_are_told(there, instead, message):
    assert there in FINGERS
    with pytest.raises(InputError) as caught:
        parse_robot(FINGERS.replace(there, instead))
    assert message in str(caught.value)

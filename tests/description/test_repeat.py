# ruff: noqa: E501  (tables: one case a line)
"""Limbs that come several times: their names, places, phases and aliases, and the sentence for what cannot be."""

import math

import pytest

from nectosome.description import (
    JointDescription,
    LoadDescription,
    dump_robot,
    get_value,
    numeric_paths,
    parse_robot,
)
from nectosome.description.orientation import from_rpy
from nectosome.io.schema.described import kinds_of
from nectosome.units import InputError

ROD = "kind: rod, section: circle, length: 1 m, radius: 1 cm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 1}"
SINE = "{kind: sine, amplitude: 20 deg, frequency: 1 Hz, phase: 10 deg}"
HINGE = f"joint: {{kind: revolute, axis: z, motion: {SINE}}}"


def robot(limbs: dict[str, str], aliases: str = "") -> str:
    rows = "".join(f"  {name}: {{{limb}}}\n" for name, limb in limbs.items())
    return f"name: a\nbody: {{kind: rigid, shape: point, mass: 1 kg}}\nlimbs:\n{rows}" + (
        f"aliases: {{{aliases}}}\n" if aliases else ""
    )


def test_copies_are_turned_about_the_axis_evenly():
    found = parse_robot(robot({"leg": f"{ROD}, offset: [1 cm, 0, 2 cm], repeat: {{count: 4, around: x}}"})).limbs
    assert [*found] == ["leg1", "leg2", "leg3", "leg4"]
    for k, leg in enumerate(found.values()):
        angle = k * math.pi / 2
        assert leg.offset == pytest.approx((0.01, -0.02 * math.sin(angle), 0.02 * math.cos(angle)), abs=1e-15)
        assert math.remainder(leg.rotation[0] - angle, 2 * math.pi) == pytest.approx(0.0, abs=1e-15)
    assert found["leg1"].offset == (0.01, 0.0, 0.02)


def test_copies_in_a_row_are_moved_on_evenly():
    limbs = {
        "leg": f"{ROD}, offset: [1 cm, 0, 2 cm], rotation: [10 deg, 20 deg, 30 deg], "
        "repeat: {count: 3, along: [-2 cm, 1 cm, 0]}",
        "toe": f"on: leg, {ROD}, {HINGE}, repeat: {{mirror: y}}",
    }
    found = parse_robot(robot(limbs, "r: limbs.leg.rotation.0")).limbs
    for k in range(3):
        leg = found[f"leg{k + 1}"]
        assert leg.offset == pytest.approx((0.01 - 0.02 * k, 0.01 * k, 0.02), abs=1e-15)
        assert leg.rotation == found["leg1"].rotation
        assert found[f"toe{k + 1}_2"].on == f"leg{k + 1}"


@pytest.mark.parametrize("axis", ["x", "z"])
def test_a_limb_that_points_up_is_turned_too(axis):
    """Pitch of -90 deg, where roll and yaw are one."""
    text = robot({"leg": f"{ROD}, rotation: [0, -90 deg, 0], repeat: {{count: 4, around: {axis}}}"})
    found = from_rpy(parse_robot(text).limbs["leg2"].rotation)
    expected = {  # columns are where its x, y and z point
        "x": ((0, 0, -1), (-1, 0, 0), (0, 1, 0)),
        "z": ((0, -1, 0), (0, 0, -1), (1, 0, 0)),
    }
    assert sum(found, ()) == pytest.approx(sum(expected[axis], ()), abs=1e-15)


def test_what_sits_on_copies_is_copied():
    found = parse_robot(
        robot(
            {
                "leg": f"{ROD}, repeat: {{count: 3, around: x}}",
                "foot": f"on: leg, {ROD}",
                "toe": f"on: foot, offset: [0, 1 cm, 0], {ROD}, repeat: {{mirror: y}}",
                "bell": f"on: leg2, {ROD}",
            }
        )
    ).limbs
    assert {name: limb.on for name, limb in found.items()} == {
        **{f"leg{k}": "body" for k in (1, 2, 3)},
        **{f"foot{k}": f"leg{k}" for k in (1, 2, 3)},
        **{f"toe{k}_{i}": f"foot{k}" for k in (1, 2, 3) for i in (1, 2)},
        "bell": "leg2",
    }
    assert [found[f"toe2_{i}"].offset[1] for i in (1, 2)] == [0.01, -0.01]


def test_drives_of_a_copy_and_of_what_sits_on_it_run_ahead():
    text = robot(
        {
            "leg": f"{ROD}, {HINGE}, repeat: {{count: 4, around: x, phase: 30 deg}}",
            "foot": f"on: leg, {ROD}, joint: {{kind: revolute, axis: z, motion: {{kind: rate, rate: 1 rad/s}}}}",
        }
    )
    found = parse_robot(text)
    for k in range(4):
        phase = get_value(found, f"limbs.leg{k + 1}.joint.motion.phase")
        assert math.degrees(phase) == pytest.approx(10 + 30 * k)
        assert math.degrees(get_value(found, f"limbs.foot{k + 1}.joint.motion.start")) == pytest.approx(30 * k)


@pytest.mark.parametrize(
    ("on", "drive", "ahead"), [("arm", SINE, 0.0), ("arm", None, 30.0), ("body", SINE, 30.0), ("body", None, 30.0)]
)
def test_a_crank_is_turned_by_the_copy_that_goes_with_its_limb_and_runs_ahead_once(on, drive, ahead):
    """By one that runs ahead itself on each copy, or by one motor; by one for all, the legs run ahead."""
    motor = "motor: {model: XC330-M288-T, inertia: 1e-4 kg m2, voltage: {kind: constant, value: 5 V}}"
    moved = motor if drive is None else f"motion: {drive}"
    leg = (
        "kind: leg, hip: [0 m, 0 m, 0 m], crank: 1 cm, bearing: [0 m, -5 cm], length: 0.3 m, turned_by: wheel, "
        "stiffness: 200 N/m, damping_ratio: 1, static_friction: 0.7, dynamic_friction: 0.6"
    )
    arm = "kind: rigid, shape: point, mass: 1 kg, repeat: {count: 3, around: x, phase: 30 deg}"
    limbs = {
        "arm": f"{arm}, loads: {{leg: {{{leg}}}}}",
        "wheel": f"on: {on}, kind: rigid, shape: point, mass: 1 g, joint: {{kind: revolute, axis: y, {moved}}}",
    }
    found = parse_robot(robot(limbs)).limbs
    for k in range(3):
        own = found[f"arm{k + 1}"].loads["leg"]
        assert own.turned_by == (f"wheel{k + 1}" if on == "arm" else "wheel")
        assert math.degrees(own.start) == pytest.approx(ahead * k)


def test_the_mirror_image_of_a_fin():
    """Reflected in y = 0: offset, yaw and hinge change their sides; lift and torsion their sense; bending in the plane stays."""
    fin = f"{ROD}, offset: [0, 3 cm, 1 cm], rotation: [10 deg, 20 deg, 30 deg], rest: {{torsion: 1 rad/m, bending_y: 2 rad/m, bending_z: 3 rad/m}}"
    fin = fin.replace("strains: {", "strains: {torsion: 0, ")
    fin += ", start: {torsion: 4 rad/m, rate: {torsion: 5 rad/m/s, bending_y: 6 rad/m/s}}"
    text = robot(
        {"fin": f"{fin}, loads: {{drag: {{kind: drag, normal: 1, lift: 0.5}}}}, {HINGE}, repeat: {{mirror: y}}"}
    )
    one, other = parse_robot(text).limbs.values()
    assert other.offset == (0.0, -0.03, 0.01)
    assert [math.degrees(x) for x in other.rotation] == pytest.approx([-10.0, 20.0, -30.0])
    assert other.joint.axis == (0.0, 0.0, -1.0)
    assert other.joint.motion == one.joint.motion
    assert (other.rest.torsion, other.rest.bending_y, other.rest.bending_z) == ((-1.0,), (2.0,), (-3.0,))
    start = other.start
    assert (start.torsion, start.rate.torsion, start.rate.bending_y) == ((-4.0,), (-5.0,), (6.0,))
    assert other.loads["drag"].lift == -0.5


@pytest.mark.parametrize(
    ("axis", "direction"), [("x", (-1.0, 0.0, 0.0)), ("y", (1.0, 0.0, 0.0)), ("z", (1.0, 0.0, 0.0))]
)
def test_an_image_still_runs_along_its_own_x(axis, direction):
    _, other = parse_robot(robot({"fin": f"{ROD}, repeat: {{mirror: {axis}}}"})).limbs.values()
    _, pitch, yaw = other.rotation
    found = (math.cos(yaw) * math.cos(pitch), math.sin(yaw) * math.cos(pitch), -math.sin(pitch))
    assert found == pytest.approx(direction, abs=1e-15)


def test_forces_in_the_frame_of_the_world_stay():
    load = "loads: {{pull: {{kind: force, force: [1 N, 2 N, 3 N], frame: {}}}}}"
    for frame, expected in (("world", 2.0), ("body", -2.0)):
        text = robot({"fin": f"{ROD}, {load.format(frame)}, repeat: {{mirror: y}}"})
        assert get_value(parse_robot(text), "limbs.fin2.loads.pull.force.1") == expected


def test_every_joint_and_load_has_an_image_or_is_refused_by_name():
    for base in (JointDescription, LoadDescription):
        for kind in kinds_of(base).values():
            assert kind.mirror is not None
            assert kind.mirror.changes.keys() <= kind.model_fields.keys()


def test_a_load_without_a_mirror_rule_is_refused_by_name(monkeypatch):
    monkeypatch.setattr(kinds_of(LoadDescription)["drag"], "mirror", None)
    text = robot({"fin": f"{ROD}, loads: {{hull: {{kind: drag, normal: 1}}}}, repeat: {{mirror: y}}"})
    with pytest.raises(InputError) as caught:
        parse_robot(text)
    assert str(caught.value) == "robot, line 4, limbs.fin.loads.hull: drag cannot be mirrored. Write both limbs out."


def test_an_alias_names_all_copies():
    limbs = {"leg": f"{ROD}, {HINGE}, repeat: {{count: 3, around: x}}", "foot": f"on: leg, {ROD}, offset: [1 mm, 0, 0]"}
    found = parse_robot(
        robot(limbs, "E: limbs.leg.young, both: [limbs.leg1.radius, limbs.foot.radius], x: limbs.foot.offset.0")
    )
    assert found.aliases["E"] == tuple(f"limbs.leg{k}.young" for k in (1, 2, 3))
    assert found.aliases["both"] == ("limbs.leg1.radius", *(f"limbs.foot{k}.radius" for k in (1, 2, 3)))
    assert found.aliases["x"] == tuple(f"limbs.foot{k}.offset.0" for k in (1, 2, 3))


def test_the_robot_reads_back_as_it_stands():
    fin = f"{ROD}, offset: [0, 3 cm, 1 cm], rotation: [10 deg, 20 deg, 30 deg], {HINGE}"
    found = parse_robot(
        robot(
            {"fin": f"{fin}, repeat: {{mirror: x}}", "leg": f"{fin}, repeat: {{count: 7, around: [1, 2, 3]}}"},
            "E: limbs.leg.young",
        )
    )
    assert "repeat" not in dump_robot(found)
    assert not [path for path in numeric_paths(found) if "repeat" in path]
    assert parse_robot(dump_robot(found)) == found


@pytest.mark.parametrize(
    ("limbs", "aliases", "message"),
    [
        ({"leg": f"{ROD}, repeat: {{count: 4}}"}, "", "robot, line 4, limbs.leg.repeat.around: is missing. Write {count: 4, around: x}, {count: 5, along: [-2 cm, 0 m, 0 m]} for a row, or {mirror: y} for a pair."),
        ({"leg": f"{ROD}, repeat: {{count: 4, around: x, along: [1 cm, 0, 0]}}"}, "", "limbs.leg.repeat.along: the copies go around an axis already. Leave one of the two out."),
        ({"leg": f"{ROD}, repeat: {{count: 4, along: [0, 0, 0]}}"}, "", "limbs.leg.repeat.along: is no step: all copies would be in one place."),
        ({"leg": f"{ROD}, repeat: {{mirror: y, along: [1 cm, 0, 0]}}"}, "", "limbs.leg.repeat.along: a mirrored limb comes twice. Leave it out, or the mirror."),
        ({"leg": f"{ROD}, repeat: {{around: x}}"}, "", "limbs.leg.repeat.count: is missing."),
        ({"leg": f"{ROD}, repeat: {{count: 1, around: x}}"}, "", 'limbs.leg.repeat.count: "1" does not fit here. A whole number from 2 to 100 expected.'),
        ({"leg": f"{ROD}, repeat: {{count: 4, around: w}}"}, "", 'limbs.leg.repeat.around: "w" is no axis.'),
        ({"leg": f"{ROD}, repeat: {{mirror: yz}}"}, "", 'limbs.leg.repeat.mirror: "yz" is not known here.'),
        ({"leg": f"{ROD}, repeat: {{mirror: y, count: 2}}"}, "", "limbs.leg.repeat.count: a mirrored limb comes twice. Leave it out, or the mirror."),
        ({"leg": f"{ROD}, repeat: {{mirror: y, phase: 90 deg}}"}, "", "limbs.leg.repeat.phase: no drive on this limb has a phase"),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}", "leg2": ROD}, "", "limbs.leg: one of its copies is called leg2, as another limb is."),
        ({"a": f"{ROD}, repeat: {{count: 100, around: x}}", "b": f"on: a, {ROD}, repeat: {{count: 6, around: x}}"}, "", "limbs.b: with its copies the robot has more than 500 limbs."),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}", "foot": f"on: leg, at: 0.5, {ROD}"}, "", "robot, line 5, limbs.foot.at: leg has no mark at 0.5."),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}", "foot": f"on: leg3, {ROD}"}, "", 'limbs.foot.on: there is no part "leg3" before this one. Did you mean "leg'),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}, joint: {{kind: planar, axis: z, motion: {{angle: {SINE}}}}}"}, "", "robot, line 4, limbs.leg.joint.motion: a planar joint with a motion cannot be mirrored. Write both limbs out."),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}"}, "E: limbs.leg.yung", 'aliases.E: "limbs.leg.yung" is no quantity of this robot. Did you mean "limbs.leg'),
        ({"leg": f"{ROD}, {HINGE}, repeat: {{mirror: y}}"}, "p: limbs.leg.repeat.phase", 'aliases.p: "limbs.leg.repeat.phase" is no quantity of this robot.'),
        ({"leg": f"{ROD}, repeat: {{mirror: y}}"}, "side: limbs.leg.offset.1", "aliases.side: the copies of leg differ in offset.1. Name one of them, as in limbs.leg1.offset.1."),
        ({"leg": f"{ROD}, {HINGE}, repeat: {{mirror: y}}", "b": f"on: leg, {ROD}, loads: {{d: {{kind: drag, normal: 1}}}}"}, "L: limbs.b.loads.d.lift", "aliases.L: the copies of b differ in loads.d.lift."),
    ],
)  # fmt: skip
def test_what_cannot_come_several_times_is_told(limbs, aliases, message):
    with pytest.raises(InputError) as caught:
        parse_robot(robot(limbs, aliases))
    assert message in str(caught.value)


def test_the_body_comes_once():
    with pytest.raises(InputError, match=r"body.repeat: the body is what all else hangs on"):
        parse_robot("name: a\nbody: {kind: rigid, shape: point, mass: 1 kg, repeat: {mirror: y}}")

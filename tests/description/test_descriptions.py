# ruff: noqa: E501  (tables: one case a line)
"""Which robots are robots: the rules between fields, and the sentence for each that is broken."""

import pytest
from pydantic import ValidationError

from nectosome.description import RobotDescription, dump_robot, parse_robot
from nectosome.units import InputError

CYLINDER = "kind: rigid, shape: cylinder, length: 85 mm, radius: 40 mm"
ROD = "kind: rod, section: circle, length: 1 m, radius: 1 cm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 1}"


def robot(body: str = f"{CYLINDER}, mass: 1 kg", **limbs: str) -> str:
    rows = [f"  {name}: {{{limb}}}" for name, limb in limbs.items()]
    return "\n".join(["name: test", f"body: {{{body}}}", "limbs:" if rows else "", *rows])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (robot(CYLINDER), "body.mass: is missing. Give a mass or a density."),
        (robot(f"{CYLINDER}, mass: 1 kg, density: 1 g/cm3"), "the mass is given already. Leave one of the two out."),
        (robot("kind: rigid, shape: box, length: 1 m, mass: 1 kg"), "body.width: is missing. A box needs length, width and height."),
        (robot(f"{CYLINDER}, mass: 1 kg, width: 1 m"), "a cylinder has no width, it needs only length and radius."),
        (robot("kind: rigid, shape: point, mass: 1 kg, length: 1 m"), "a point has no length, it has no size. Leave it out."),
        (robot("kind: rigid, shape: point, density: 1 kg/m3"), "body.density: a point has no size"),
        (robot("kind: rigid, shape: spheroid, length: 1 m, radius: 1 m, mass: 1 kg, bend: 3 deg"), "body.bend: a spheroid has no bend"),
        (robot(f"{CYLINDER}, mass: 1 kg, inertia: [1 kg m2, 1 kg m2, 3 kg m2]"), "body.inertia: no body has these moments"),
        (robot(f"{CYLINDER}, mass: 1 kg, bend: 400 deg"), 'must be from -360 deg to 360 deg'),
        (robot(f"{CYLINDER}, mass: 1 kg, loads: {{a: {{kind: spheroid_added_mass}}}}"), "body.loads.a.kind: spheroid_added_mass acts on spheroid, not on a cylinder."),
        (robot(f"{CYLINDER}, mass: 1 kg, loads: {{a: {{kind: force, force: [0, 0, 0], at: 0.5}}}}"), "body.loads.a.at: only a rod has marks."),
        (robot(f"{ROD}, loads: {{a: {{kind: lumped_drag, drag_area: [0, 0, 0]}}}}"), "body.loads.a.kind: lumped_drag acts on rigid parts, not on a rod."),
        (robot(f"{ROD}, loads: {{a: {{kind: force, force: [0, 0, 0], at: 0.5}}}}"), "body.loads.a.at: the rod has no mark at 0.5."),
        (robot(f"{ROD}, width: 1 m"), "body.width: a rod of section circle has no width, only radius and tip_radius."),
        (robot(ROD.replace("section: circle", "section: ellipse").replace("radius: 1 cm, ", "")), "body.width: is missing. A rod of section ellipse needs width and height."),
        (robot(ROD.replace("{bending_y: 1}", "{}")), "body.strains: a rod needs at least one of torsion"),
        (robot(f"{ROD}, marks: [0.5, 0.5]"), "body.marks: the marks must increase along the rod."),
        (robot(f"{ROD}, points: 1"), 'body.points: "1" does not fit here. A whole number from 2 to 200 expected.'),
        (robot(f"{ROD}, on: body"), "body.on: the body is what all else hangs on"),
        (robot(a=f"{ROD}, on: b", b=ROD), 'limbs.a.on: there is no part "b" before this one. It comes later in the file: move it up.'),
        (robot(legs=ROD, a=f"{ROD}, on: leg"), 'limbs.a.on: there is no part "leg" before this one. Did you mean "legs"?'),
        (robot(body2=ROD, a=f"{ROD}, on: body2, at: 0.25"), "limbs.a.at: body2 has no mark at 0.25."),
        (robot(a=f"{ROD}, at: middle"), 'limbs.a.at: "middle" is no place on a part.'),
        (robot(Leg=ROD), 'limbs.Leg: "Leg" cannot be used as a name. Write small letters'),
        (robot(a=f"{ROD}, joint: {{kind: revolute, axis: w}}"), 'limbs.a.joint.axis: "w" is no axis.'),
        (robot(a=f"{ROD}, joint: {{kind: revolute, axis: [0, 0, 0]}}"), "limbs.a.joint.axis: the axis has no length."),
        (robot(a=f"{ROD}, joint: {{kind: revolute, axis: x, motion: {{kind: rate, rate: 1 rad/s}}, torque: {{kind: constant, value: 0}}}}"), "a joint with a motion cannot have a torque as well."),
        (robot(a=f"{ROD}, joint: {{kind: revolute, axis: x, limits: {{torque: 1 N m, speed: 1 rpm}}}}"), "limbs.a.joint.limits: are those of a servo"),
        (robot(a=f"{ROD}, joint: {{kind: prismatic, axis: x, velocity: 1 m/s, motion: {{kind: rate, rate: 1 m/s}}}}"), "the motion already says where the joint starts."),
        (robot(a=f"{ROD}, joint: {{kind: planar, axis: z, start: {{position: [0, 0, 1 m]}}}}"), "limbs.a.joint.start.position: the position leaves the plane"),
        (robot() + "\naliases: {x: body.lenght}", 'aliases.x: "body.lenght" is no quantity of this robot. Did you mean "body.length"?'),
        (robot() + "\naliases: {x: [body.length, body.mass]}", "aliases.x: these paths are quantities of different kinds."),
        (robot() + "\naliases: {x: body.strips}", 'aliases.x: "body.strips" is no quantity of this robot.'),
    ],
)  # fmt: skip
def test_a_broken_rule_is_told(text, message):
    with pytest.raises(InputError) as caught:
        parse_robot(text)
    assert message in str(caught.value)


def test_a_robot_of_everything_reads_back_exactly():
    text = """
name: everything
water: {surface: -0.3 m, current: [0.1 m/s, 0, 0]}
body:
  {kind: rigid, shape: point, mass: 1 kg, volume: 1 L, inertia: [1 kg m2, 1 kg m2, 2 kg m2],
   joint: {kind: free, start: {orientation: [0, 90 deg, 0], velocity: [1 m/s, 0, 0]}}}
limbs:
  box: {kind: rigid, shape: box, length: 1 m, width: 1 m, height: 1 m, density: 900 kg/m3, at: root, strips: 7,
    offset: [1 mm, 0, 0], joint: {kind: planar, axis: [0, 1, 1], start: {angle: 3 deg}}}
  egg: {kind: rigid, shape: spheroid, length: 1 m, radius: 0.2 m, mass: 3 kg, loads: {a: {kind: spheroid_added_mass}}}
  strip: {kind: rod, section: rectangle, length: 1 m, width: 1 cm, height: 1 mm, tip_width: 5 mm, young: 1 GPa,
    density: 1 g/cm3, strains: {shear_z: 0, torsion: 2}, rest: {torsion: [1 1/m, 0.5 1/m], extension: 1.2},
    marks: [0.25, 0.5], joint: {kind: spherical, stiffness: 1 N m}, loads: {
      a: {kind: force, force: [1 N, 0, 0], at: 0.25, frame: body}, b: {kind: distributed_force, force: [0, 0, 1 N/m]}}}
  leg: {kind: rigid, shape: cylinder, length: 1 m, radius: 1 cm, mass: 1 kg, on: strip, at: 0.25,
    loads: {a: {kind: cylinder_added_mass, coefficient: 0.9}},
    joint: {kind: prismatic, axis: y, stiffness: 3 N/m, force: {kind: sine, amplitude: 1 N, frequency: 2 Hz}}}
  foot: {kind: rigid, shape: point, mass: 1 g, on: leg,
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 3 deg, frequency: 2 Hz, phase: 90 deg}}}
"""
    robot = parse_robot(text)
    assert list(robot.limbs["strip"].strains) == ["torsion", "shear_z"]
    assert robot.limbs["strip"].rest.torsion == (1.0, 0.5)
    assert robot.limbs["foot"].joint.axis == (0.0, 0.0, 1.0)
    assert parse_robot(dump_robot(robot)) == robot


def test_python_gives_si_floats():
    robot = RobotDescription.model_validate(
        {"name": "a", "body": {"kind": "rigid", "shape": "point", "mass": 2.5, "volume": "1 L"}}
    )
    assert (robot.body.mass, robot.body.volume) == (2.5, 0.001)
    with pytest.raises(ValidationError, match="must be at least 0 kg"):
        RobotDescription.model_validate({"name": "a", "body": {"kind": "rigid", "shape": "point", "mass": -1.0}})


def test_a_description_cannot_be_changed(flagellum):
    with pytest.raises(ValidationError):
        flagellum.name = "other"

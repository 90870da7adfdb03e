"""A joint along which nothing has inertia is refused, with what to give; all others are not."""

import pytest

from nectosome.description import parse_robot
from nectosome.mechanism import check_inertia
from nectosome.model import build
from nectosome.solve import simulate
from nectosome.units import InputError

MOTOR = "torque_constant: 0.5 N m/A, resistance: 2 ohm, inertia: {rotor}, voltage: {{kind: constant, value: 6 V}}"
POINT = """
name: point
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  centre_of_mass: {centre}
  joint: {{kind: revolute, axis: x, {moved}}}
"""
ARM = """
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    centre_of_mass: [0 m, 0.2 m, 0 m]
    joint: {{kind: revolute, axis: {axis}}}
"""


def point(rotor="0 kg m2", centre="[0 m, 0 m, 0 m]", moved=MOTOR, after=""):
    moved = f"motor: {{{MOTOR.format(rotor=rotor)}}}" if moved is MOTOR else moved
    return build(parse_robot(POINT.format(centre=centre, moved=moved) + after))


def test_a_motor_without_a_rotor_that_turns_a_point_is_refused_before_it_is_simulated():
    with pytest.raises(InputError, match=r"nothing has inertia along body\.angle") as told:
        simulate(point(), 1.0)
    assert told.value.field == "body"
    assert "Give it an inertia, or a centre_of_mass away from the axis, or the motor" in told.value.message
    assert "(body.joint.motor.inertia)" in told.value.message


def test_two_joints_about_one_axis_have_one_inertia_only():
    """The hinge of a point carries that of an arm about the same axis: their difference turns nothing."""
    robot = point(moved="stiffness: 1 N m/rad", after=ARM.format(axis="x"))
    with pytest.raises(InputError, match=r"nothing has inertia along body\.angle, arm\.angle"):
        check_inertia(robot)


@pytest.mark.parametrize("given", [{"rotor": "1e-6 kg m2"}, {"centre": "[0 m, 1 mm, 0 m]"}])
def test_what_has_inertia_passes(given):
    check_inertia(point(**given))


def test_a_chain_whose_first_part_is_a_point_passes():
    check_inertia(point(moved="stiffness: 1 N m/rad", after=ARM.format(axis="z")))


ROD = """
name: rod
body:
  kind: rod
  section: circle
  radius: 10 mm
  length: 0.5 m
  young: 1 MPa
  density: 1100 kg/m3
  strains: {STRAINS}
  points: 4
  marks: [0.3, 0.6]
"""


@pytest.mark.parametrize("strain", ["torsion", "extension"])
def test_a_strain_with_more_coordinates_than_points_is_refused(strain):
    """A Legendre polynomial of order n vanishes at the n Gauss points of a rod, so that nothing there would move."""
    check_inertia(build(parse_robot(ROD.replace("STRAINS", f"{strain}: 3"))))
    with pytest.raises(InputError, match=r"nothing has inertia along .*4, so that it has no acceleration") as told:
        check_inertia(build(parse_robot(ROD.replace("STRAINS", f"{strain}: 4"))))
    assert "Give the rod at least 5 points, or strains of lower orders." in told.value.message
    assert told.value.field == "body"

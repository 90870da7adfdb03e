# ruff: noqa: E501  (tables: one case a line)
"""Pairs of parts in robot files: what is refused and why, and that they read back and have paths."""

import pytest

from nectosome.description import dump_robot, get_value, numeric_paths, numeric_values, parse_robot
from nectosome.units import InputError

TEXT = """
name: pairs
body: {kind: rigid, shape: box, length: 1 m, width: 1 m, height: 1 m, mass: 1 kg}
limbs:
  rod: {kind: rod, section: circle, length: 1 m, radius: 1 cm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 1}, marks: [0.5]}
  log: {kind: rigid, shape: cylinder, length: 85 mm, radius: 40 mm, mass: 1 kg}
  egg: {kind: rigid, shape: spheroid, length: 1 m, radius: 0.2 m, mass: 3 kg}
  ball: {kind: rigid, shape: spheroid, length: 0.4 m, radius: 0.2 m, mass: 3 kg}
pairs:
  pin: {kind: bushing, between: [rod, body], at: [0.5, root], offset: [[0, 1 mm, 0], [0, 0, 0]], stiffness: 1 kN/m}
  grip: {kind: contact, between: [rod, log], stiffness: 1 kN/m, static_friction: 0.5, dynamic_friction: 0.4}
  rest: {kind: contact, between: [ball, rod], stiffness: 1 kN/m}
"""


@pytest.mark.parametrize(
    ("there", "instead", "message"),
    [
        ("[rod, body]", "[rode, body]", 'line 10, pairs.pin.between.0: there is no part "rode". Did you mean "rod"?'),
        ("[rod, body]", "[rod, rod]", "pairs.pin.between: a pair is of two parts, these are one."),
        ("[rod, body]", "[rod]", "pairs.pin.between"),
        ("radius: 0.2 m, mass: 3 kg}\npairs", "radius: 0.2 m, mass: 3 kg, loads: {pin: {kind: force, force: [0, 0, 0]}}}\npairs", "pairs.pin: a load is called pin too, and results tell them apart by name."),
        ("[0.5, root]", "[0.4, root]", "pairs.pin.at.0: rod has no mark at 0.4. Write tip or root, or add the mark."),
        ("[0.5, root]", "[0.5, 0.5]", "pairs.pin.at.1: body has no mark at 0.5. Write tip or root, or add the mark."),
        ("[rod, log]", "[rod, body]", "pairs.grip.between.1: body is a box: contact is between rods, cylinders, capsules and spheres. Add a cylinder to it."),
        ("[rod, log]", "[egg, log]", "pairs.grip.between.0: egg is no sphere: a spheroid in contact needs a length of twice its radius."),
        ("dynamic_friction: 0.4", "dynamic_friction: 0.6", "pairs.grip.dynamic_friction: what slips has no more friction"),
        ("dynamic_friction: 0.4", "creep: 0 m/s", 'line 11, pairs.grip.creep: "0 m/s" is out of range: it must be more than 0 m/s.'),
        ("stiffness: 1 kN/m, static", "stiffness: 1 kN, static", "pairs.grip.stiffness"),
        ("kind: contact, between: [ball", "kind: glue, between: [ball", "pairs.rest"),
    ],
)  # fmt: skip
def test_a_pair_that_does_not_fit_is_told(there, instead, message):
    assert there in TEXT
    with pytest.raises(InputError) as caught:
        parse_robot(TEXT.replace(there, instead), "robot.yaml")
    assert message in str(caught.value)
    assert "Error" not in str(caught.value)


def test_pairs_read_back_and_have_paths():
    robot = parse_robot(TEXT)
    assert parse_robot(dump_robot(robot)) == robot
    assert {"pairs.pin.offset.0.1", "pairs.grip.static_friction", "pairs.rest.softness"} <= set(numeric_paths(robot))
    assert get_value(robot, "pairs.pin.offset.0.1") == 1e-3


def test_all_values_at_once_are_those_one_by_one():
    robot = parse_robot(TEXT)
    assert numeric_values(robot) == {path: get_value(robot, path) for path in numeric_paths(robot)}

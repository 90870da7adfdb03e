"""No load, pair or tendon mixes with the rows of results that the program makes itself."""

import pytest

from nectosome import robots
from nectosome.description import parse_robot
from nectosome.description.own_rows import OWN_ROWS
from nectosome.mechanism import load_names
from nectosome.model import build
from nectosome.units import InputError

ARMS = """
name: arms
water: {surface: 1 m}
body: {kind: rigid, shape: spheroid, length: 0.3 m, radius: 0.1 m, density: 1000 kg/m3, loads: LOADS}
limbs:
  arm:
    kind: rigid
    shape: spheroid
    length: 0.2 m
    radius: 0.02 m
    density: 1000 kg/m3
    joint:
      kind: revolute
      axis: z
      stiffness: 1 N m/rad
      damping: 0.1 N m s/rad
      friction: 0.1 N m
      lower: {at: -1 rad, stiffness: 100 N m/rad, damping: 1 N m s/rad}
    loads: {added_mass: {kind: spheroid_added_mass}}
pairs: PAIRS
tendons: TENDONS
"""
SKIN = """
name: skin
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  bar: {kind: rigid, shape: cylinder, length: 0.1 m, radius: 1 mm, mass: 1 g, offset: [0, 9 mm, 0], repeat: {mirror: y}}
webs: {web: {between: bar, thickness: 1 mm, young: 1 MPa, density: 1 g/cm3}}
"""
LOAD, PAIR = "{kind: force, force: [0 N, 0 N, 0 N]}", "{kind: bushing, between: [body, arm], stiffness: 1 kN/m}"
TENDON = "{over: {arm: 10 mm}, stiffness: 100 N/m}"


def arms(loads: str = "{}", pairs: str = "{}", tendons: str = "{}"):
    return parse_robot(ARMS.replace("LOADS", loads).replace("PAIRS", pairs).replace("TENDONS", tendons))


@pytest.mark.parametrize("name", OWN_ROWS)
def test_the_programs_own_rows_are_refused_as_names(name):
    for field, given in (
        ("body.loads", {"loads": f"{{{name}: {LOAD}}}"}),
        ("pairs", {"pairs": f"{{{name}: {PAIR}}}"}),
        ("tendons", {"tendons": f"{{{name}: {TENDON}}}"}),
    ):
        with pytest.raises(InputError) as caught:
            arms(**given)
        assert caught.value.field == f"{field}.{name}"
        why = f'"{name}" is the row of {OWN_ROWS[name]} in results, which would mix with it. Choose another name.'
        assert caught.value.message == why


def test_the_list_has_all_rows_that_the_program_makes():
    """Springs, dampers, friction, stops, at a surface; motors; a jet, whose chamber changes its shape; rods; webs."""
    found = set[str]()
    for robot in (arms(), parse_robot(SKIN), *map(robots.describe, ("tuna", "jelly"))):
        own = {name for part in robot.parts.values() for name in part.loads} | {*robot.pairs, *robot.tendons}
        found |= {*load_names(build(robot))} - (own - {"added_mass"})
    assert found == {*OWN_ROWS}

# ruff: noqa: E501  (tables: one case a line)
"""Webs in robot files: what is refused and why, rings of copies, and that they read back."""

import pytest

from nectosome.description import dump_robot, get_value, parse_robot, with_values
from nectosome.units import InputError

TEXT = """
name: webbed
body: {kind: rigid, shape: point, mass: 1 kg}
limbs:
  arm: {kind: rod, section: circle, radius: 2 mm, length: 60 mm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 0}, points: 4, offset: [0 m, 0 m, 20 mm], repeat: {count: 3, around: x}}
  fin: {kind: rod, section: circle, radius: 2 mm, length: 60 mm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 0}, points: 4}
  bar: {kind: rigid, shape: cylinder, radius: 2 mm, length: 60 mm, mass: 1 g}
  eye: {kind: rigid, shape: point, mass: 1 g}
webs:
  bell: {between: arm, thickness: 1 mm, young: 20 kPa, density: 1 g/cm3, loads: {drag: {kind: plate_drag, normal: 1.2}, water: {kind: sheet_added_mass}}}
  leaf: {between: [fin, bar], thickness: 1 mm, young: 20 kPa, density: 1 g/cm3}
aliases:
  t: webs.bell.thickness
"""


def test_a_ring_of_copies_is_closed_and_a_row_is_open():
    d = parse_robot(TEXT)
    bell, leaf = d.webs["bell"], d.webs["leaf"]
    assert bell.gaps == (("arm1", "arm2"), ("arm2", "arm3"), ("arm3", "arm1"))
    assert (bell.closed, bell.root) == (True, "closed")
    assert (leaf.gaps, leaf.closed, leaf.root) == ((("fin", "bar"),), False, "open")
    assert bell.loads["drag"].start_up is not None  # left open: a web goes to and fro
    assert get_value(with_values(d, {"t": 2e-3}), "webs.bell.thickness") == 2e-3


def test_webs_read_back():
    d = parse_robot(TEXT)
    assert parse_robot(dump_robot(d)) == d


@pytest.mark.parametrize(
    ("there", "instead", "message"),
    [
        ("[fin, bar]", "[fin, bat]", 'line 11, webs.leaf.between: there is no limb "bat". Did you mean "bar"?'),
        ("[fin, bar]", "fin", "webs.leaf.between: fin comes once: a web joins two limbs or more. Name another limb."),
        ("[fin, bar]", "[fin, bar, fin]", "webs.leaf.between: fin stands twice. Name each limb once; closed: true makes a ring."),
        ("[fin, bar]", "[fin, eye]", "webs.leaf.between: eye has no length along which a web could lie. Join rods, or rigid bodies with a length."),
        ("[fin, bar]", "[fin, bar], closed: true", "webs.leaf.closed: a ring has three limbs or more. Name more limbs, or write closed: false."),
        ("leaf:", "fin:", "webs.fin: a limb is called fin too, and results tell them apart by name."),
        ("kind: sheet_added_mass", "kind: added_mass, normal: 1", "webs.bell.loads.water.kind: added_mass does not act on a web. Take plate_drag, sheet_added_mass or bell_jet."),
        ("thickness: 1 mm, young: 20 kPa, density: 1 g/cm3}", "thickness: 1 mm, young: 20 kPa, density: 1 g/cm3, loads: {jet: {kind: bell_jet}}}", "webs.leaf.loads.jet.kind: bell_jet needs a ring of limbs, and this web is open: closed: true."),
        ("kind: sheet_added_mass", "kind: bell_jet, contraction: 0", 'webs.bell.loads.water.contraction: "0" is out of range'),
        ("kind: sheet_added_mass", "kind: bell_jet, refill: 2", 'webs.bell.loads.water.refill: "2" is out of range'),
        ("{drag: {kind: plate_drag, normal: 1.2}, ", "{membrane: {kind: plate_drag, normal: 1.2}, ", '"membrane" is the row of tension of webs in results'),
        ("thickness: 1 mm, young: 20 kPa, density: 1 g/cm3}", "young: 20 kPa, density: 1 g/cm3}", "webs.leaf.thickness: is missing."),
        ("thickness: 1 mm, young: 20 kPa, density: 1 g/cm3}", "thickness: 1 mm, young: 20 kPa, density: 1 g/cm3, slack: -1}", 'webs.leaf.slack: "-1" is out of range'),
        ("mass: 1 kg}", "mass: 1 kg, loads: {water: {kind: sheet_added_mass}}}", "body.loads.water.kind: sheet_added_mass acts on a web or a soft plate only."),
    ],
)  # fmt: skip
def test_a_web_that_does_not_fit_is_told(there, instead, message):
    assert there in TEXT
    with pytest.raises(InputError) as caught:
        parse_robot(TEXT.replace(there, instead), "robot.yaml")
    assert message in str(caught.value)


def test_rods_of_a_web_have_the_same_places():
    text = TEXT.replace("[fin, bar]", "[fin, arm1]").replace("points: 4}\n", "points: 5, marks: [0.5]}\n")
    with pytest.raises(InputError) as caught:
        parse_robot(text, "robot.yaml")
    why = (
        "fin has 5 points, marks [0.5]; arm1 has 4 points, marks []. Give the rods of a web the same points and marks."
    )
    assert why in str(caught.value)

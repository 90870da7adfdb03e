"""How a robot lies in the water, in `show`: weights and centres that are known, and the body that makes it neutral."""

import re
from pathlib import Path

import pytest
from tests.made_up_runs import unpacked

PAIR = """
name: pair
water: {density: 1000 kg/m3}
body:
  kind: rigid
  shape: box
  length: 0.2 m
  width: 0.1 m
  height: 0.1 m
  density: 900 kg/m3
  centre_of_mass: [0 m, 0 m, -1 cm]
  offset: [0 m, 0 m, 0.3 m]
  joint: {kind: free}
limbs:
  rod:
    kind: rod
    section: rectangle
    width: 0.05 m
    height: 0.05 m
    length: 0.4 m
    young: 1 MPa
    density: 1500 kg/m3
    strains: {bending_y: 1}
    joint: {kind: revolute, axis: y, motion: {kind: constant, value: 90 deg}}
"""

PINNED = """
name: pinned
body: {kind: rigid, shape: box, length: 60 mm, width: 60 mm, height: 60 mm, density: 2700 kg/m3, joint: {kind: free}}
limbs:
  a:
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    density: 1000 kg/m3
    joint: {kind: revolute, axis: z}
  b:
    on: body
    at: root
    offset: [0 m, 50 mm, 0 m]
    kind: rigid
    shape: cylinder
    length: 100 mm
    radius: 5 mm
    density: 1000 kg/m3
    joint: {kind: revolute, axis: z}
pairs:
  pin: {kind: bushing, between: [a, b], stiffness: 1e4 N/m, damping: 10 N s/m}
"""


def line(page: str, name: str) -> str:
    """Return what is said of the whole robot beside a name, with what goes on in the next lines."""
    found = re.search(rf"^{name}  +(.*(?:\n {{8,}}.*)*)", page, re.MULTILINE)
    assert found is not None
    return " ".join(found[1].split())


def test_weights_and_centres_of_two_bricks(nectosome):
    """A box of 2 l at 900 kg/m3 and a rod of 1 l at 1500 kg/m3 that hangs down from its end, by hand."""
    Path("pair.yaml").write_text(PAIR)
    page = nectosome("show", "pair.yaml").out
    assert line(page, "moves") == "8 degrees of freedom, 1 prescribed: rod.angle"
    assert line(page, "mass") == "3.3 kg, displaces 3 kg"
    assert line(page, "weight in water") == (
        "2.942 N downward, 9.091 % of its weight; 0.3 kg too heavy; neutral with body.density 750 kg/m3"
    )
    mass = ((1.8 * 0.1 + 1.5 * 0.2) / 3.3, 0.0, (1.8 * 0.29 + 1.5 * 0.1) / 3.3)
    water = ((2 * 0.1 + 1 * 0.2) / 3, 0.0, (2 * 0.3 + 1 * 0.1) / 3)
    for name, expected in (("centre of mass", mass), ("centre of buoyancy", water)):
        found = [float(x) for x in line(page, name).strip("() m").split(", ")]
        assert found == pytest.approx(expected, rel=1e-3)


def test_with_what_is_told_it_is_neutral(nectosome):
    Path("pair.yaml").write_text(PAIR.replace("density: 900 kg/m3", "density: 750 kg/m3"))
    assert line(nectosome("show", "pair.yaml").out, "weight in water") == "none: it is neutral"
    Path("pair.yaml").write_text(PAIR.replace("density: 900 kg/m3", "mass: 1 kg"))
    told = line(nectosome("show", "pair.yaml").out, "weight in water")
    assert told == "4.903 N upward, 20 % of its weight; 0.5 kg too light; neutral with body.mass 1.5 kg"
    Path("pair.yaml").write_text(PAIR.replace("density: 1500 kg/m3", "density: 4 g/cm3"))
    assert line(nectosome("show", "pair.yaml").out, "weight in water").endswith("its body is lighter than that")


def test_a_robot_whose_limbs_are_tied_in_pairs_is_told_what_makes_it_neutral(nectosome):
    """Its limbs are as dense as its water: so must its body be, of 0.216 l."""
    Path("pinned.yaml").write_text(PINNED)
    answer = nectosome("show", "pinned.yaml")
    assert (answer.code, answer.err) == (0, "")
    told = line(answer.out, "weight in water")
    assert told.endswith("0.3672 kg too heavy; neutral with body.density 1000 kg/m3")


def test_the_page_of_a_robot_has_a_picture_and_the_numbers(nectosome):
    Path("pair.yaml").write_text(PAIR)
    answer = nectosome("show", "pair.yaml", "--plot", "pair.html")
    assert (answer.code, answer.err) == (0, "")
    page = Path("pair.html").read_text()
    assert "neutral with body.density 750 kg/m3" in page
    scene = re.search(r'<script type="text/plain" id="figure-1-scene-1">(.*?)</script>', page, re.DOTALL)
    assert scene is not None
    shown = unpacked(scene[1].strip())
    assert b"/world/body" in shown and b"/world/rod" in shown

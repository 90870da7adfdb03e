"""Water that a file leaves in no load is told: between flaps, and inside of a ring that closes."""

import pytest

from nectosome.description import parse_robot
from nectosome.description.water_left_out import water_left_out

FLAPS = """
name: flaps
body: {kind: rigid, shape: cylinder, length: 30 mm, radius: 30 mm, mass: 0.1 kg}
limbs:
  flap:
    kind: rod
    section: rectangle
    width: 16 mm
    height: 3 mm
    length: 80 mm
    young: 0.3 MPa
    density: 1000 kg/m3
    strains: {bending_y: 0}
    points: 3
    offset: [0 mm, 0 mm, 30 mm]
    rotation: [0 deg, -130 deg, 0 deg]
    repeat: {count: 8, around: x}
"""
WEB = "webs: {bell: {between: flap, thickness: 1 mm, young: 50 kPa, density: 1 g/cm3CLOSED}}\n"
CRANK = "nozzle: 8 cm2, inlet: 20 cm2, crank: {kind: rate, rate: 5 rad/s}"
JET = "mass: 0.1 kg, loads: {jet: {kind: jet, volume: [40 mL, 20 mL, 20 mL, 30 mL], " + CRANK + "}}}"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (FLAPS, {"limbs.flap1": "8 flat rods stand side by side, and the water between them is in no load"}),
        (FLAPS.replace("count: 8", "count: 4"), {}),  # far apart
        (FLAPS.replace("height: 3 mm", "height: 16 mm"), {}),  # arms
        (FLAPS + WEB.replace("CLOSED", ""), {"webs.bell": "the water that this ring drives out as it closes"}),
        (FLAPS + WEB.replace("CLOSED", ", closed: false"), {}),
        (FLAPS + WEB.replace("CLOSED", ", loads: {jet: {kind: bell_jet}}"), {}),
        (FLAPS.replace("mass: 0.1 kg}", JET) + WEB.replace("CLOSED", ""), {}),
    ],
)
def test_what_is_left_out_is_told(text, told):
    found = dict(water_left_out(parse_robot(text)))
    assert {*found} == {*told}
    assert all(words in found[path] for path, words in told.items())

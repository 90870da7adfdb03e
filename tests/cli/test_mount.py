"""What a robot that is held does to its mount, as `periodic` and `simulate` print it."""

import json

import pytest

HELD = """
name: held fin
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 0.3 kg, volume: 0 m3,
  joint: {kind: prismatic, axis: x, motion: {kind: constant, value: 0 m}}}
limbs:
  fin: {kind: rigid, shape: box, length: 120 mm, width: 4 mm, height: 60 mm, density: 1100 kg/m3,
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 40 deg, frequency: 1 Hz, offset: 30 deg}},
    loads: {drag: {kind: plate_drag, normal: 1.5}}}
"""


def test_a_held_fin_says_what_it_does_to_its_mount(nectosome, tmp_path):
    """The mean force on the mount is minus that of the joint which holds it; speeds of 0 are not printed."""
    (tmp_path / "held.yaml").write_text(HELD)
    for command in (("periodic", "held.yaml"), ("simulate", "held.yaml", "--time", "3s")):
        tables = json.loads(nectosome(*command, "--json").out)["tables"]
        force, holds = tables["mount"]["force"], tables["driven_joints"]["body.position"]
        assert force["x"]["value"] == pytest.approx(-holds["reaction"]["value"], rel=1e-4)
        assert abs(force["x"]["value"]) > 1e-3
        assert "speed" not in tables.get("cycle", {})

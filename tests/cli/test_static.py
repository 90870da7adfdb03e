"""The shape at rest from the command line: a beam of which the deflection is known, and what nothing holds."""

import json
from pathlib import Path

import pytest

from nectosome.io import load_dataset

BEAM = """
name: beam
water: {density: 1000 kg/m3}
body:
  kind: rod
  section: circle
  length: 0.5 m
  radius: 5 mm
  young: 10 MPa
  density: 1020 kg/m3
  strains: {bending_y: 2}
  joint: {kind: revolute, axis: y, motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz}}
  loads: {drag: {kind: drag, normal: 1}}
"""


def test_a_beam_sags_by_its_weight_in_water(nectosome):
    """w L^4 / 8 E I with w = 20 kg/m3 g pi r^2, 2.45 mm; its servo, held, carries w L^2 / 2, though it is in swing."""
    Path("beam.yaml").write_text(BEAM)
    answer = nectosome("static", "beam.yaml", "--save", "beam.nc", "--plot", "beam.html")
    assert (answer.code, answer.err) == (0, "")
    assert "beam: at rest" in answer.out
    w = 20 * 9.80665 * 3.141592653589793 * 0.005**2
    sag = w * 0.5**4 / (8 * 10e6 * 3.141592653589793 / 4 * 0.005**4)
    data = load_dataset("beam.nc")
    assert float(data["position"][0, -1, 2]) == pytest.approx(-sag, rel=2e-3)
    assert float(data["reaction"][0, 0]) == pytest.approx(-w * 0.5**2 / 2, rel=1e-3)
    assert float(abs(data["load_power"]).max()) == 0.0
    assert data["support_force"].values[0] == pytest.approx([0, 0, -w * 0.5], abs=1e-9)
    assert data["support_moment"].values[0] == pytest.approx([0, w * 0.5**2 / 2, 0], rel=1e-3, abs=1e-9)
    said = {line.split("  ")[0]: line.split() for line in answer.out.splitlines()}
    assert float(said["force"][-2]) == pytest.approx(-w * 0.5, rel=1e-3)
    assert float(said["moment about the root"][-4]) == pytest.approx(w * 0.5**2 / 2, rel=1e-3)
    row = next(line for line in answer.out.splitlines() if line.startswith("body "))
    assert "y" not in answer.out.partition("on its support")[0].split()  # it cannot leave its plane
    assert float(row.split()[2]) == pytest.approx(-sag, rel=2e-3)
    page = Path("beam.html").read_text()
    assert "beam: at rest" in page
    assert "body.angle" in page


def test_what_nothing_holds_is_named(nectosome, ball):
    answer = nectosome("static", str(ball))
    assert (answer.code, answer.out) == (1, "")
    assert answer.err == (
        "ball: nothing holds body.position, so that there is no one place of rest. "
        'Hold it, as with --set "body.joint={kind: fixed}", or see nectosome steady.\n'
    )


def test_what_cannot_move_has_no_shape_to_be_found(nectosome, ball):
    answer = nectosome("static", str(ball), "--set", "body.joint={kind: fixed}")
    assert (answer.code, answer.out) == (2, "")
    assert answer.err.endswith("nothing of this robot is free to move: there is no shape to be found.\n")


def test_a_shape_that_does_not_last_is_told(nectosome):
    """A heavy stick that stands on its hinge."""
    Path("stick.yaml").write_text(
        "name: stick\nbody: {kind: rigid, shape: cylinder, length: 1 m, radius: 1 cm, density: 2000 kg/m3,\n"
        "  joint: {kind: revolute, axis: y, position: -90 deg}}\n"
    )
    answer = nectosome("static", "stick.yaml")
    assert answer.code == 1
    assert answer.err.startswith("stick: found, but unstable")
    assert "UNSTABLE" in answer.out


FLOATS = (
    "name: barge\nwater: {density: 1000 kg/m3, gravity: 9.81 m/s2, surface: 0 m}\nbody: {kind: rigid, shape: box,\n"
    "  length: 2 m, width: 0.8 m, height: 0.5 m, mass: 320 kg,\n"
    "  centre_of_mass: [0 m, 0 m, -0.1 m], joint: {kind: free}}\n"
)


def test_what_floats_tells_its_draught_and_its_levers(nectosome):
    """T = 0.2 m, GM = T/2 + w2/(12 T) - KG."""
    Path("barge.yaml").write_text(FLOATS)
    answer = nectosome("static", "barge.yaml", "--json", "--plot", "barge.html")
    assert answer.code == 0, answer.err
    found = json.loads(answer.out)["tables"]
    height = 0.1 + 0.8**2 / 2.4 - 0.15
    assert found["floating"]["draught"]["value"] == pytest.approx(0.2, rel=1e-7)
    assert found["floating"]["metacentric_height_heel"]["value"] == pytest.approx(height, rel=1e-6)
    assert found["floating"]["trim"]["value"] == pytest.approx(0, abs=1e-9)
    for side in ("starboard", "port"):
        assert found["righting"]["90 deg"][side]["value"] == pytest.approx(0.1, rel=1e-6)  # BG on its side
    assert found["floating"]["smaller_side"] == "both alike"
    page = Path("barge.html").read_text()
    assert all(words in page for words in ("righting arm GZ", "heel to starboard, heel to port"))


def test_a_barge_with_a_list_has_the_smaller_arms_there(nectosome):
    """A mirrored barge has the same numbers with its sides swapped."""
    found = []
    for offset in ("0.06 m", "-0.06 m"):
        Path("barge.yaml").write_text(FLOATS.replace("[0 m, 0 m,", f"[0 m, {offset},"))
        answer = nectosome("static", "barge.yaml", "--json")
        assert answer.code == 0, answer.err
        found.append(json.loads(answer.out)["tables"])
    port, starboard = found
    assert (port["floating"]["smaller_side"], starboard["floating"]["smaller_side"]) == ("port", "starboard")
    assert port["sides"]["port"]["largest_arm"]["value"] < 0.7 * port["sides"]["starboard"]["largest_arm"]["value"]
    for one, other in (("port", "starboard"), ("starboard", "port")):
        for key, cell in port["sides"][one].items():
            assert cell["value"] == pytest.approx(starboard["sides"][other][key]["value"], rel=1e-6), key
        arm = starboard["righting"]["30 deg"][other]["value"]
        assert port["righting"]["30 deg"][one]["value"] == pytest.approx(arm, rel=1e-6)


def test_what_sinks_is_told_by_how_much(nectosome):
    Path("barge.yaml").write_text(FLOATS.replace("320 kg", "900 kg"))
    answer = nectosome("static", "barge.yaml")
    assert (answer.code, answer.out) == (1, "")
    assert "it sinks: its weight exceeds its buoyancy by 981 N, and nothing holds it." in answer.err


def test_show_tells_how_it_floats(nectosome):
    Path("barge.yaml").write_text(FLOATS)
    said = nectosome("show", "barge.yaml").out
    assert "draught 200 mm, trim 0 deg, heel 0 deg" in said
    assert "0.2167 m against heel" in said

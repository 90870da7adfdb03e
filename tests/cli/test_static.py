"""The shape at rest from the command line: a beam of which the deflection is known, and what nothing holds."""

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

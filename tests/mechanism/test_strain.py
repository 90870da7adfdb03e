"""Strain and stress of bending against beam theory."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.description.plausible import meaningless
from nectosome.mechanism import bending_of
from nectosome.solve import load_stepping
from nectosome.units import InputError

BEAM = """
name: beam
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: SECTION
  width: 20 mm
  height: 12 mm
  length: 0.4 m
  young: 3 MPa
  density: 1000 kg/m3
  strains: {bending_y: 3, bending_z: 3}
  rest: {REST: 1.5 rad/m}
  joint: {kind: fixed}
  loads:
    moment: {kind: force, force: [0 N, 0 N, 0 N], moment: MOMENT, frame: body}
"""


@pytest.mark.parametrize(
    ("section", "Iy", "Iz"),
    [
        ("ellipse", np.pi / 4 * 0.010 * 0.006**3, np.pi / 4 * 0.006 * 0.010**3),
        ("rectangle", 0.020 * 0.012**3 / 12, 0.012 * 0.020**3 / 12),
    ],
)
def test_a_beam_under_a_moment_at_its_tip_is_strained_as_beam_theory_says(described, section, Iy, Iz):
    """sigma = M c / I, the same all along in either plane; the curvature at rest is free of stress."""
    for moment, rest, across, wanted in (
        ("[0 N m, 2e-3 N m, 0 N m]", "bending_y", 1, 2e-3 * 0.006 / Iy),
        ("[0 N m, 0 N m, -3e-3 N m]", "bending_z", 0, 3e-3 * 0.010 / Iz),
    ):
        robot = described(BEAM.replace("SECTION", section).replace("MOMENT", moment).replace("REST", rest))
        bent = jax.jit(bending_of)(robot, load_stepping(robot).value.q)
        np.testing.assert_allclose(bent.stress[:, across], wanted, rtol=1e-6)
        np.testing.assert_allclose(bent.stress[:, 1 - across], 0, atol=1e-6 * wanted)
        np.testing.assert_allclose(bent.strain, bent.stress / 3e6, rtol=1e-12)
        assert np.isnan(bent.hinge_stress).all()


HINGE = """
name: hinge
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 0.1 m
  width: 40 mm
  height: 2 mm
  mass: 10 g
  joint:
    {kind: revolute, axis: y, rest: 5 deg, flexure: {as_printed: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}}
"""


def test_the_layer_of_a_hinge_is_strained_by_the_moment_of_its_spring(described):
    """A moment k theta on a layer 6 mm thick: sigma = 6 k theta / (w h^2)."""
    robot = described(HINGE)
    angle = np.radians(45.0)
    bent = bending_of(robot, jnp.array([angle]))
    k = float(robot.loads[0].load.stiffness)
    assert float(bent.hinge_stress[0]) == pytest.approx(6 * k * (angle - np.radians(5)) / (0.040 * 0.006**2))
    assert float(bent.hinge_strain[0]) == pytest.approx(float(bent.hinge_stress[0]) / 2e6)
    assert np.isnan(bent.strain).all()


GAP = "{gap: 5 mm, width: 40 mm, young: 2 MPa, THICKNESS}"


def test_the_strain_of_a_hinge_is_that_of_its_gap(described):
    """theta h / 2 g at the face, k = E I / g; by a stiffness as measured h follows. 4.4 times that of the printed layer
    of the same stiffness, (L / pi 0.85^2 g)^(2/3)."""
    layer = "{as_printed: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}"
    printed, strain = described(HINGE), {}
    k = float(printed.loads[0].load.stiffness)
    assert k == pytest.approx(np.pi * 0.85**2 * 2e6 * 0.04 * 0.006**3 / 12 / 0.105, rel=1e-12)
    h = (12 * k * 0.005 / (2e6 * 0.04)) ** (1 / 3)
    for given in (f"thickness: {h!r} m", f"stiffness: {k!r} N m/rad"):
        spring = described(HINGE.replace(layer, GAP.replace("THICKNESS", given))).loads[0].load
        assert float(spring.stiffness) == pytest.approx(k, rel=1e-9)
        strain = spring.bending(jnp.array([np.radians(45.0)]))  # at 5 deg it is at ease
        np.testing.assert_allclose(strain, np.radians(40) * h / 0.010 * np.array([1, 2e6]), rtol=1e-9)
        more = strain[0] / printed.loads[0].load.bending(jnp.array([np.radians(45.0)]))[0]
        assert float(more) == pytest.approx((0.105 / (np.pi * 0.85**2 * 0.005)) ** (2 / 3), rel=1e-9)
        assert float(more) == pytest.approx(4.4, rel=0.005)


@pytest.mark.parametrize(
    ("strip", "field", "says"),
    [
        ("length: 105 mm, thickness: 6 mm", "length", "Write gap for that between"),
        ("thickness: 6 mm", "gap", "is missing"),
        ("gap: 5 mm", "thickness", "is missing"),
        ("gap: 5 mm, as_printed: 105 mm, thickness: 3 mm", "as_printed", "Leave one of the two out"),
        ("gap: 5 mm, stiffness: 1 N m/rad, thickness: 3 mm", "stiffness", "Leave one of the two out"),
        ("gap: 5 mm, ratio: 0.8, thickness: 3 mm", "ratio", "goes with as_printed"),
        ("gap: 5 mm, stiffness: 0 N m/rad", "stiffness", "more than 0"),
    ],
)
def test_a_strip_has_one_length_and_one_stiffness(strip, field, says):
    layer = "{as_printed: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}"
    text = HINGE.replace(layer, f"{{{strip}, width: 40 mm, young: 2 MPa}}")
    with pytest.raises(InputError, match=says) as told:
        parse_robot(text)
    assert told.value.field == f"body.joint.flexure.{field}"


def test_a_strip_as_printed_is_told_of_once():
    robot = parse_robot(HINGE)
    ((path, sentence),) = [told for told in meaningless(robot) if "flexure" in told[0]]
    assert path == "body.joint.flexure.as_printed"
    assert "a gap of 5 mm of the same stiffness has 4.4 times as much" in sentence
    gap = "{gap: 5 mm, width: 40 mm, thickness: 2.86 mm, young: 2 MPa}"
    layer = "{as_printed: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}"
    assert not [told for told in meaningless(parse_robot(HINGE.replace(layer, gap))) if "flexure" in told[0]]

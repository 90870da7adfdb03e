"""Strain and stress of bending against beam theory."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.mechanism import bending_of
from nectosome.solve import load_stepping

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
  joint: {kind: revolute, axis: y, rest: 5 deg, flexure: {length: 105 mm, width: 40 mm, thickness: 6 mm, young: 2 MPa}}
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

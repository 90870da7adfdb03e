"""The energy of each part: closed forms of a sledge, an arm that turns on it, and a bent rod at the arm's end."""

import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.core.programs.remember import remembered
from nectosome.description import parse_robot
from nectosome.mechanism import diagnose
from nectosome.model import build

ROBOT = """
name: sledge
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: box
  length: 200 mm
  width: 30 mm
  height: 60 mm
  mass: 3 kg
  inertia: [1e-3 kg m2, 1e-3 kg m2, 1e-3 kg m2]
  joint: {kind: prismatic, axis: x}
  loads: {water: {kind: given_added_mass, mass: [0.7 kg, 0 kg, 0 kg]}}
limbs:
  arm:
    on: body
    kind: rigid
    shape: box
    length: 400 mm
    width: 30 mm
    height: 30 mm
    mass: 0.5 kg
    inertia: [1e-3 kg m2, 1e-3 kg m2, 2e-3 kg m2]
    joint: {kind: revolute, axis: z}
  tail:
    on: arm
    kind: rod
    section: circle
    length: 100 mm
    radius: 10 mm
    young: 1 MPa
    density: 1000 kg/m3
    strains: {bending_z: 0}
    points: 4
    joint: {kind: fixed}
"""
U, W, BENT = 2.0, 3.0, 4.0  # m/s, rad/s, curvature [1/m]; the coordinate is the angle over the length


def test_parts_have_the_energies_of_closed_forms_and_together_that_of_the_robot():
    robot = build(parse_robot(ROBOT))
    x = State(jnp.array([0.0, 0.0, BENT * 0.1]), jnp.array([U, W, 0.0]), robot.initial().z)
    found = remembered(diagnose, robot, jnp.zeros(()), x)
    body, arm, tail = np.asarray(found.part_energy)
    assert body == pytest.approx([3.0 * U**2 / 2, 0.7 * U**2 / 2, 0])
    assert arm == pytest.approx([0.5 * (U**2 + (W * 0.2) ** 2) / 2 + 2e-3 * W**2 / 2, 0, 0])
    assert tail[2] == pytest.approx(1e6 * np.pi / 4 * 0.01**4 * BENT**2 * 0.1 / 2)
    assert tail[0] > 0
    np.testing.assert_allclose(found.part_energy.sum(axis=0), found.energy, rtol=1e-14)

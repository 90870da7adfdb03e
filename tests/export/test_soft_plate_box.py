"""A soft plate in formats of rigid bodies: a stiff box with its mass, at its place, and words for what is lost."""

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.export.body_tree import body_tree_of
from nectosome.model import build

FIN = """
name: fin
limbs:
  fin: {on: world, kind: soft_plate, length: 0.1 m, width: [40 mm, 80 mm], middle: [0 mm, 10 mm], thickness: 2 mm,
    young: 1 MPa, density: 1200 kg/m3, modes: [2, 2], points: [4, 3], joint: {kind: revolute, axis: y}}
  ball: {on: fin, kind: rigid, shape: point, mass: 10 g, offset: [20 mm, 0 mm, 0 mm]}
"""


def test_a_soft_plate_is_a_stiff_box_there():
    description = parse_robot(FIN)
    tree = body_tree_of(build(description), description)
    fin, ball = tree.bodies
    assert fin.numbers.mass == pytest.approx(1200 * 0.1 * 0.06 * 2e-3)
    np.testing.assert_allclose(fin.solids[0].half, [0.05, 0.03, 1e-3])
    assert fin.joints[0].kind == "hinge"
    np.testing.assert_allclose(ball.position, [0.12, 0.01, 0.0])  # from the middle of the tip
    assert "fin: its bending and its outline; here it is a stiff box of its mean sizes" in tree.left_out

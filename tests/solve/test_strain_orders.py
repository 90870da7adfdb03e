"""How far the order of strains puts the tip of a rod off, against shapes that are known."""

import numpy as np
import pytest

from nectosome.description import parse_robot
from nectosome.solve import strain_order_errors, strain_orders
from nectosome.solve.strain_orders import OrderError
from nectosome.units import InputError

COIL = """
name: coil
water: {gravity: 9.81 m/s2, density: 1 kg/m3}
limbs:
  coil:
    on: world
    kind: rod
    section: circle
    radius: 2 mm
    length: 600 mm
    young: 20 MPa
    poisson: 0.5
    density: 1100 kg/m3
    damping: 1 kPa s
    rest: {bending_z: 50 rad/m, torsion: -8 rad/m}
    strains: {bending_y: 3, bending_z: 3, torsion: 3}
    points: 40
"""
BEAM = """
name: beam
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: circle
  radius: 5 mm
  length: 300 mm
  young: 1 MPa
  density: 1000 kg/m3
  strains: {bending_y: ORDER}
  points: 24
  joint: {kind: fixed}
  loads: {end: {kind: force, force: [0 N, 0 N, 0.1 mN], at: tip}}
"""


@pytest.mark.slow
def test_a_coil_of_several_turns_is_told_how_far_it_is_off():
    """Tip at (-4.59, 4.94, -144.75) mm by shooting, 24 mm from that of order 3, which order 4 moves by 3.6 mm."""
    ((one),) = strain_order_errors(parse_robot(COIL))
    assert one.orders == (3, 8, 18)
    assert one.off == pytest.approx(0.024, rel=0.02)
    assert not one.enough
    assert "not enough: its tip is 23.9" in str(one)
    assert "it may be more" not in str(one)


def test_a_beam_under_a_force_at_its_end_needs_a_curvature_that_falls_evenly(monkeypatch):
    """F L^3 / 3 E I with order 1 and more, F L^3 / 4 E I with the mean curvature alone: one finer order has it all."""
    monkeypatch.setattr(strain_orders, "_FINER", 1)
    (one,) = strain_order_errors(parse_robot(BEAM.replace("ORDER", "0")))
    away = 1e-4 * 0.3**3 / (1e6 * np.pi / 4 * 0.005**4)
    assert one.off == pytest.approx(away * (1 / 3 - 1 / 4), rel=2e-4)
    assert one.orders == (0, 2)


@pytest.mark.slow
def test_an_order_that_is_enough_is_told_to_be():
    (fine,) = strain_order_errors(parse_robot(BEAM.replace("ORDER", "2")))
    assert fine.off < 1e-6
    assert fine.enough
    assert "order 2 is enough" in str(fine)


def test_an_estimate_that_still_moves_says_so():
    moved = OrderError("rod", 0.1, (1, 4, 10), np.array([2e-3, 9e-3]))
    assert "not enough: its tip is 9 mm off" in str(moved)
    assert "of which the first is 2 mm away: it may be more" in str(moved)
    assert "nothing is known" in str(OrderError("rod", 0.1, (1, 4), np.array([np.nan])))


def test_robots_without_anything_finer_are_refused():
    with pytest.raises(InputError, match="order 20, the largest"):
        strain_order_errors(parse_robot(BEAM.replace("ORDER", "20")))
    with pytest.raises(InputError, match="no rod"):
        strain_order_errors("paddle")

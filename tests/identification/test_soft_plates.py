"""Soft plates in a fit and in a design: a fit recovers their numbers, and derivatives are those of differences."""

import numpy as np
import pytest

import nectosome as ns
from nectosome.description import parse_robot
from nectosome.description.variables import read_variable
from nectosome.designs import MotionDesign

BLADE = """
name: blade
water: {density: 1000 kg/m3}
body:
  kind: soft_plate
  length: 100 mm
  width: 60 mm
  thickness: 2 mm
  young: 1 MPa
  damping: 300 Pa s
  density: 1100 kg/m3
  modes: [2, 2]
  joint: {kind: revolute, axis: y, motion: {kind: sine, amplitude: 20 deg, frequency: 1 Hz}}
  loads:
    drag: {kind: plate_drag, normal: 1.5, start_up: none}
    water: {kind: sheet_added_mass}
aliases:
  E: body.young
  thin: body.thickness.0.0
"""
T = np.linspace(0.0, 1.0, 51)


@pytest.mark.slow
def test_modulus_and_drag_of_a_blade_follow_from_the_path_of_its_tip():
    """A synthetic recording of the plate itself, without noise."""
    run = ns.simulate(parse_robot(BLADE), 1.0, samples=len(T), rtol=1e-7, atol=1e-9)
    recording = {"time": T, "tip": np.asarray(ns.reading(run, "body.tip.position.z"))}
    found = ns.identify(
        parse_robot(BLADE),
        [recording],
        settings=["E=1.6MPa", "body.loads.drag.normal=1.2"],
        vary={"E": "0.3..3MPa log", "body.loads.drag.normal": (0.5, 3.0)},
        compare={"tip": "body.tip.position.z"},
    )
    np.testing.assert_allclose(found.theta, [1e6, 1.5], rtol=1e-3)


@pytest.mark.slow
def test_the_power_of_a_blade_has_the_derivatives_of_differences_by_modulus_and_thickness():
    robot = parse_robot(BLADE)
    ranges = {"E": "0.5 MPa .. 2 MPa", "thin": "1.5 mm .. 2.5 mm"}
    evaluate = MotionDesign(robot, tuple(read_variable(*each, robot) for each in ranges.items()), "power").prepare()
    u, h = np.array([0.4, 0.6]), 2e-3 * np.array([0.6, 0.8])
    there, after, before = (evaluate(u + k * h, k == 0, None) for k in (0, 1, -1))
    assert there.gradient @ h == pytest.approx(0.5 * (after.objective - before.objective), rel=5e-3)

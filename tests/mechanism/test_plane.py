"""Equations in a plane against those in space, for every joint, link, load and tendon that a plane has."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.mechanism import InPlane, in_plane, moves_in_plane, reduced
from nectosome.model import build
from nectosome.robots import describe
from nectosome.solve import simulate

FLAT = """
name: flat
water: {density: 1000 kg/m3, gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: box
  length: 0.3 m
  width: 0.2 m
  height: 0.1 m
  density: 900 kg/m3
  centre_of_mass: [10 mm, 5 mm, -8 mm]
  offset: [0.1 m, 0.2 m, 0.3 m]
  rotation: [180 deg, 0 deg, 30 deg]
  joint: {kind: planar, axis: z, start: {angle: 20 deg}, drive: {y: {kind: sine, amplitude: 2 N, frequency: 1 Hz}}}
  loads:
    hull: {kind: lumped_drag, drag_area: [0.01 m2, 0.02 m2, 0.03 m2], rotational: [1e-3 kg m2, 0 kg m2, 2e-3 kg m2]}
    water:
      kind: given_added_mass
      matrix:
        - [1, 0.1, 0, 0, 0.02, 0.03]
        - [0.1, 2, 0, 0.01, 0, 0.04]
        - [0, 0, 3, 0, 0.02, 0]
        - [0, 0.01, 0, 0.02, 0, 0]
        - [0.02, 0, 0.02, 0, 0.03, 0]
        - [0.03, 0.04, 0, 0, 0, 0.05]
limbs:
  slide:
    kind: rigid
    shape: cylinder
    length: 0.15 m
    radius: 10 mm
    bend: 60 deg
    density: 1100 kg/m3
    strips: 3
    rotation: [90 deg, 0 deg, 40 deg]
    joint: {kind: prismatic, axis: [1, 0, 2], stiffness: 20 N/m, force: {kind: constant, value: 0.3 N}}
    loads:
      drag: {kind: drag, normal: 1.1, tangential: 0.02, lift: -0.1}
      water: {kind: added_mass, normal: 0.6, tangential: 0.1}
      stokes: {kind: stokes_drag, coefficients: gray_hancock, wavelength: 0.15 m}
      wake: {kind: trailing_edge}
  arm:
    on: slide
    at: tip
    kind: rigid
    shape: point
    mass: 20 g
    rotation: [90 deg, 0 deg, 0 deg]
    joint: {kind: revolute, axis: z, motion: {kind: stroke, amplitude: 40 deg, frequency: 0.7 Hz}}
    loads: {push: {kind: force, force: [0.1 N, 0.2 N, 0.3 N], moment: [0 N m, 0 N m, 0.02 N m]}}
  blade:
    on: arm
    kind: rigid
    shape: box
    length: 100 mm
    width: 2 mm
    height: 40 mm
    mass: 30 g
    strips: 4
    joint:
      kind: revolute
      axis: z
      stiffness: 0.03 N m/rad
      rest: 0.1 rad
      lower: {at: -0.2 rad, stiffness: 10 N m/rad, damping: 0.01 N m s/rad, softness: 1 deg}
    loads: {drag: {kind: plate_drag, normal: 1.2}}
  other:
    on: body
    at: root
    kind: rigid
    shape: box
    length: 100 mm
    width: 2 mm
    height: 40 mm
    mass: 30 g
    strips: 4
    rotation: [0 deg, 0 deg, 90 deg]
    joint: {kind: revolute, axis: z, damping: 0.01 N m s/rad, torque: {kind: sine, amplitude: 0.1 N m, frequency: 2 Hz}}
    loads: {drag: {kind: plate_drag, normal: 0.8}}
  carried:
    on: slide
    kind: rigid
    shape: spheroid
    length: 0.2 m
    radius: 30 mm
    mass: 0.5 kg
    offset: [1 cm, 2 cm, 3 cm]
    joint:
      kind: planar
      axis: [0, 1, 0]
      motion:
        x: {kind: sine, amplitude: 2 cm, frequency: 0.5 Hz}
        angle: {kind: rate, rate: 3 rad/s}
    loads: {water: {kind: spheroid_added_mass}}
tendons:
  wound:
    {over: {other: -30 mm}, stiffness: 1 kN/m, damping: 2 N s/m, pretension: 20 N, pulled_by: {part: slide, ratio: 1}}
  cranked:
    over: {other: 40 mm, blade: -10 mm}
    stiffness: 1 kN/m
    pulled_by: {part: arm, crank: 40 mm, guide: 90 mm, angle: -70 deg}
"""


@pytest.fixture(scope="module", params=["[180 deg, 0 deg, 30 deg]", "[100 deg, 20 deg, 30 deg]"], ids=["flat", "steep"])
def flat(request):
    """A robot in a level plane, or in one that leans, where weight acts along it too."""
    return build(parse_robot(FLAT.replace("[180 deg, 0 deg, 30 deg]", request.param)))


@jax.jit
def both(robot, x, a, u):
    """Residuals and rates by the equations in space and by those in the plane."""
    t = jnp.asarray(0.3)
    return [(system.residual(t, x, a, u), system.rates(t, x, u).v) for system in (robot, in_plane(robot))]


@pytest.mark.parametrize("seed", range(5))
def test_the_equations_in_the_plane_are_those_in_space(flat, seed):
    assert moves_in_plane(flat)
    assert isinstance(reduced(flat), InPlane)
    q, v, a, u = jax.random.normal(jax.random.key(seed), (4, len(flat.coordinate_names)))
    space, plane = both(flat, State(q, v, flat.initial().z), 10 * a, u)
    for one, other in zip(space, plane, strict=True):
        np.testing.assert_allclose(other, one, rtol=0, atol=1e-12 * np.abs(one).max())


@pytest.mark.parametrize(
    "change",
    [
        ("rotation: [90 deg, 0 deg, 40 deg]", "rotation: [90 deg, 1 deg, 40 deg]"),
        ("axis: [1, 0, 2]", "axis: [1, 1e-6, 2]"),
        ("joint: {kind: planar, axis: z, start: {angle: 20 deg}, drive: {y:", "joint: {kind: free, drive: {force_y:"),
        ("gravity: 9.81 m/s2", "gravity: 9.81 m/s2, current: [0.1 m/s, 0 m/s, 0 m/s]"),
    ],
)
def test_what_leaves_the_plane_keeps_its_equations(change):
    robot = build(parse_robot(FLAT.replace(*change)))
    assert not moves_in_plane(robot)
    assert reduced(robot) is robot


def test_a_soft_robot_keeps_its_equations():
    assert not moves_in_plane(build(describe("flagellum")))


def test_simulations_in_the_plane_and_in_space_agree():
    """A lean of 1e-9 rad is too much for the plane and too little for the motion."""
    flat = describe("paddle1", ["A=60deg"])
    leaning = describe("paddle1", ["A=60deg", "limbs.segment1.rotation.0=1e-9rad"])
    assert moves_in_plane(build(flat))
    assert not moves_in_plane(build(leaning))
    runs = [simulate(build(d), 0.5, samples=6, method="explicit", rtol=1e-8, atol=1e-10) for d in (flat, leaning)]
    np.testing.assert_allclose(*(run.value.state.q for run in runs), rtol=0, atol=1e-7)
    np.testing.assert_allclose(*(run.value.state.v for run in runs), rtol=0, atol=1e-6)

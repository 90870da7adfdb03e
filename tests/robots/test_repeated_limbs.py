"""Limbs that come several times move as one another's images: held against the mechanics, not against the rules."""

from itertools import pairwise

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State
from nectosome.description import parse_robot
from nectosome.model import build
from nectosome.solve import simulate

HANDED = """
name: handed
about: one of everything that has a hand, on a body without one
water: {{gravity: 0 m/s2{floor}}}
body:
  {{kind: rigid, shape: point, mass: 1 kg, inertia: [1 g m2, 1 g m2, 1 g m2], joint: {{kind: free}}}}
limbs:
  arm:
    kind: rigid
    shape: cylinder
    length: 0.2 m
    radius: 1 cm
    bend: 40 deg
    mass: 0.1 kg
    centre_of_mass: [0 m, 5 mm, 2 mm]
    offset: [1 cm, 4 cm, 2 cm]
    rotation: [20 deg, -30 deg, 50 deg]
    repeat: {{mirror: {axis}}}
    joint:
      {{kind: revolute, axis: [1, 2, 3], position: 20 deg, velocity: 3 rad/s, stiffness: 1 N m/rad,
        torque: {{kind: sine, amplitude: 0.1 N m, frequency: 1 Hz, offset: 0.2 N m}}}}
    loads:
      drag: {{kind: drag, normal: 1.1, lift: 0.3}}
      added_mass: {{kind: added_mass, normal: 0.6}}
      line: {{kind: distributed_force, force: [1 N/m, 2 N/m, 3 N/m], frame: body}}
      pull: {{kind: force, force: [1 N, 2 N, 3 N], moment: [0.1 N m, 0.2 N m, 0.3 N m], frame: body}}
      thrust:
        {{kind: pulsed_thrust, values: [1 N, 3 N, 2 N, 1 N], rated: 5 rad/s, speed: 4 rad/s, start: 30 deg,
          direction: [1, 2, 3], place: [1 cm, 2 cm, 3 cm]}}
      jet:
        {{kind: jet, volume: [80 ml, 60 ml, 50 ml, 60 ml], nozzle: 4 cm2, inlet: 6 cm2, bell: 0.5, direction: [1, 2, 1],
          place: [1 cm, 2 cm, 3 cm], crank: {{kind: rate, rate: 8 rad/s, start: 40 deg}}}}
{leg}
  ball:
    on: arm
    kind: rod
    section: ellipse
    width: 2 cm
    height: 1 cm
    length: 0.2 m
    young: 1 MPa
    density: 1100 kg/m3
    points: 4
    offset: [1 mm, 2 mm, 3 mm]
    strains: {{torsion: 0, bending_y: 1, bending_z: 1, extension: 0, shear_y: 0, shear_z: 0}}
    rest: {{torsion: 3 rad/m, bending_y: [2 rad/m, 1 rad/m], bending_z: 4 rad/m, shear_y: 0.05, shear_z: 0.03}}
    joint:
      kind: spherical
      stiffness: 0.1 N m/rad
      start: {{orientation: [10 deg, 20 deg, 30 deg], angular_velocity: [1 rad/s, 2 rad/s, 3 rad/s]}}
      drive: {{x: {{kind: constant, value: 0.1 N m}}, z: {{kind: sine, amplitude: 0.2 N m, frequency: 1 Hz}}}}
    loads:
      drag: {{kind: drag, normal: 1.1, tangential: 0.1, lift: -0.2}}
      tendon:
        {{kind: tendon, place: [6 mm, 2 mm], tip_place: [-3 mm, 1 mm], along: [0, 0.7],
          tension: {{kind: constant, value: 0.3 N}}}}
      chamber:
        {{kind: chamber, place: [3 mm, -1 mm], area: 10 mm2,
          pressure: {{kind: sine, amplitude: 20 kPa, frequency: 1 Hz}}}}
      twist:
        {{kind: muscle, strain: torsion, moment: {{kind: wave, amplitude: 1 mN m, offset: 2 mN m, frequency: 1 Hz}}}}
      bend:
        {{kind: muscle, strain: bending_z, moment: {{kind: wave, amplitude: 3 mN m, frequency: 1 Hz, phase: 1 rad}}}}
      nod: {{kind: muscle, strain: bending_y, moment: {{kind: wave, amplitude: 3 mN m, frequency: 1 Hz, phase: 1 rad}}}}
      edge: {{kind: trailing_edge}}
  float:
    on: ball
    kind: rigid
    shape: spheroid
    length: 4 cm
    radius: 1 cm
    density: 900 kg/m3
    joint:
      kind: free
      start:
        position: [1 cm, 2 cm, 3 cm]
        orientation: [40 deg, 50 deg, 60 deg]
        velocity: [1 m/s, 2 m/s, 3 m/s]
        angular_velocity: [3 rad/s, 2 rad/s, 1 rad/s]
      drive:
        torque_x: {{kind: constant, value: 1 N m}}
        torque_y: {{kind: constant, value: 2 N m}}
        torque_z: {{kind: constant, value: 3 N m}}
        force_x: {{kind: constant, value: 4 N}}
        force_y: {{kind: constant, value: 5 N}}
        force_z: {{kind: cycle, values: [1 N, 2 N, 4 N, 1 N], frequency: 1 Hz}}
    loads:
      drag: {{kind: lumped_drag, drag_area: [1 cm2, 2 cm2, 3 cm2], rotational: [1 g m2, 2 g m2, 3 g m2]}}
      water:
        kind: given_added_mass
        matrix: {matrix}
  slide:
    on: arm
    at: root
    kind: rigid
    shape: box
    length: 5 cm
    width: 2 cm
    height: 1 cm
    density: 1100 kg/m3
    joint: {{kind: prismatic, axis: [1, 2, 3], position: 1 cm, velocity: 0.5 m/s, stiffness: 10 N/m}}
    loads: {{drag: {{kind: plate_drag, normal: 1.2}}}}
  wing:
    on: slide
    kind: rigid
    shape: box
    length: 5 cm
    width: 2 cm
    height: 1 cm
    density: 1100 kg/m3
    joint:
      kind: planar
      axis: [2, 1, 0]
      start: {{position: [-1 cm, 2 cm, 3 cm], angle: 20 deg, velocity: [-1 m/s, 2 m/s, 1 m/s], angular_speed: 2 rad/s}}
    loads: {{drag: {{kind: plate_drag, normal: 1.2}}}}
  made:
    on: arm
    kind: rigid
    shape: box
    length: 5 cm
    width: 2 cm
    height: 1 cm
    density: 1100 kg/m3
    joint:
      kind: spherical
      motion:
        roll: {{kind: sine, amplitude: 20 deg, frequency: 1 Hz, phase: 20 deg, offset: 10 deg}}
        pitch: {{kind: rate, rate: 2 rad/s, start: 10 deg}}
        yaw: {{kind: stroke, amplitude: 20 deg, frequency: 1 Hz, forward_share: 0.3}}
    loads: {{drag: {{kind: plate_drag, normal: 1.2}}}}
  base:
    on: made
    kind: rigid
    shape: box
    length: 5 cm
    width: 2 cm
    height: 1 cm
    density: 1100 kg/m3
    joint:
      kind: free
      motion:
        y: {{kind: sine, amplitude: 2 cm, frequency: 1 Hz, phase: 20 deg}}
        roll: {{kind: rate, rate: 2 rad/s, start: 10 deg}}
        yaw: {{kind: constant, value: 20 deg}}
    loads: {{drag: {{kind: plate_drag, normal: 1.2}}}}
tendons: {{cord: {{over: {{arm: 20 mm}}, stiffness: 500 N/m, damping: 3 N s/m, pretension: 5 N}}}}
"""
LEG = """
      leg:
        {kind: leg, hip: [1 cm, 2 cm, 3 cm], crank: 1 cm, bearing: [0 m, -5 cm], length: 0.3 m, speed: 4 rad/s,
          stiffness: 200 N/m, damping_ratio: 1, static_friction: 0.7, dynamic_friction: 0.6, normal: 0.03 kg/m}
"""
rng = np.random.default_rng(0)
_A = rng.normal(size=(6, 6)) * 0.1
MATRIX = [[float(x) for x in row] for row in _A @ _A.T]


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_pair_pulls_its_body_along_the_mirror_only(axis):
    """Places of the two are images, and what the body lacks for rest is a force in the plane, a moment normal to it."""
    leg, floor = (LEG, ", floor: -0.1 m") if axis == "y" else ("", "")
    robot = build(parse_robot(HANDED.format(axis=axis, matrix=MATRIX, leg=leg, floor=floor)))
    x = robot.initial()
    v = x.v.at[3 + "xyz".index("x" if axis == "y" else "y")].set(0.4)  # on its way along the plane
    acting = jax.jit(lambda r, x: r.forces(jnp.asarray(0.13), x, jnp.zeros_like(x.v)))(robot, State(x.q, v, x.z))
    S = np.where(np.arange(3) == "xyz".index(axis), -1.0, 1.0)
    stations = {p.name: n.stations for p, n in zip(robot.tree.parts, robot.tree.layout, strict=True)}
    place = {name: np.asarray(acting.shape.position[here]) for name, here in stations.items()}
    twist = {name: np.asarray(acting.twist[here]) for name, here in stations.items()}
    assert len(place) == 15
    for name in ("arm", "ball", "float", "slide", "wing", "made", "base"):
        assert place[f"{name}2"] == pytest.approx(place[f"{name}1"] * S, abs=1e-12)
        D = np.array([-1, 1, -1, 1, -1, 1])  # in frames that are images of one another
        assert twist[f"{name}2"] == pytest.approx(twist[f"{name}1"] * D, abs=1e-12)
    turning, pulling = np.asarray(acting.residual[:3]), np.asarray(acting.residual[3:6])
    assert turning[S > 0] == pytest.approx(0.0, abs=1e-9 * np.abs(turning).max())
    assert pulling[S < 0] == pytest.approx(0.0, abs=1e-9 * np.abs(pulling).max())
    assert abs(turning[S < 0]) > 0.1
    assert np.abs(pulling[S > 0]).min() > 0.1


SWIMMER = """
name: swimmer
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: spheroid
  length: 0.3 m
  radius: 4 cm
  density: 1000 kg/m3
  joint: {{kind: free}}
  loads:
    drag: {{kind: lumped_drag, drag_area: [1e-3 m2, 1e-2 m2, 1e-2 m2], rotational: [0.1 g m2, 1 g m2, 1 g m2]}}
    added_mass: {{kind: spheroid_added_mass}}
limbs:
  fin:
    kind: rod
    at: root
    section: rectangle
    width: 3 cm
    height: 4 mm
    tip_width: 1 cm
    length: 0.15 m
    young: 0.5 MPa
    damping: 1 kPa s
    density: 1000 kg/m3
    strains: {{torsion: 0, bending_y: 0, bending_z: 0}}
    rest: {{torsion: 2 rad/m, bending_z: 2 rad/m}}
    points: 4
    rotation: {rotation}
    offset: {offset}
    repeat: {repeat}
    joint: {{kind: revolute, axis: [1, 2, 0], motion: {{kind: sine, amplitude: 30 deg, frequency: 1.5 Hz}}}}
    loads: {{drag: {{kind: drag, normal: 2, lift: 0.2}}, added_mass: {{kind: added_mass, normal: 1}}}}
"""


@pytest.mark.slow
def test_a_mirrored_pair_driven_alike_swims_straight():
    text = SWIMMER.format(rotation="[20 deg, 10 deg, 130 deg]", offset="[5 cm, 4 cm, 0 m]", repeat="{mirror: y}")
    data = simulate(build(parse_robot(text)), 0.25, samples=6).to_dataset()
    force = data["load_force"].sum(["load", "part"])
    largest = float(np.abs(force).max())
    assert largest > 0.01
    assert np.abs(force.sel(axis="y")).max() < 1e-6 * largest
    body = data["velocity"].sel(part="body")
    assert np.abs(body.sel(axis="y")).max() < 1e-6 * np.abs(body).max()
    last = data.isel(time=-1)
    one, other = (last["position"].values[last["station_part"].values == name] for name in ("fin1", "fin2"))
    assert other == pytest.approx(one * [1, -1, 1], abs=1e-7)
    assert np.ptp(one[:, 1]) > 0.05


def test_fins_around_an_axis_drive_their_body_along_it():
    """Three equal fins: the sum of what they give is along the axis, and each is the one before turned by 120 deg."""
    text = SWIMMER.format(
        rotation="[20 deg, 10 deg, 130 deg]", offset="[5 cm, 4 cm, 0 m]", repeat="{count: 3, around: x}"
    )
    data = simulate(build(parse_robot(text)), 0.15, samples=4).to_dataset()
    body = data["velocity"].sel(part="body").isel(time=-1).values
    assert np.abs(body[1:]).max() < 1e-6 * abs(body[0])
    last = data.isel(time=-1)
    places = [last["position"].values[last["station_part"].values == f"fin{k}"] for k in (1, 2, 3)]
    c, s = np.cos(2 * np.pi / 3), np.sin(2 * np.pi / 3)
    turn = np.array([[1, 0, 0], [0, c, -s], [0, s, c]])
    for before, after in pairwise(places):
        assert after == pytest.approx(before @ turn.T, abs=1e-7)

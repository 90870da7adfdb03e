import jax
import jax.numpy as jnp
import pytest

from nectosome.description import RobotDescription, parse_robot
from nectosome.model import build
from nectosome.robots import describe

# every kind of joint, link, load and tendon, rods on links, a link on a rod's mark, a rod on a rod
ZOO = """
name: zoo
water: {density: 1000 kg/m3, gravity: 9.81 m/s2, current: [0.1 m/s, -0.05 m/s, 0.02 m/s]}
body:
  kind: rigid
  shape: box
  length: 0.3 m
  width: 0.2 m
  height: 0.1 m
  density: 900 kg/m3
  centre_of_mass: [10 mm, 5 mm, -8 mm]
  offset: [0.1 m, 0.2 m, 0.3 m]
  rotation: [10 deg, 20 deg, 30 deg]
  joint: {kind: free, start: {orientation: [0.3 rad, -0.2 rad, 0.5 rad]}}
  loads:
    hull: {kind: lumped_drag, drag_area: [0.01 m2, 0.02 m2, 0.03 m2], rotational: [1e-3 kg m2, 0 kg m2, 0 kg m2]}
    water: {kind: given_added_mass, mass: [1 kg, 2 kg, 3 kg], inertia: [0.01 kg m2, 0.02 kg m2, 0.03 kg m2]}
limbs:
  swing:
    kind: rigid
    shape: spheroid
    length: 0.2 m
    radius: 30 mm
    mass: 0.5 kg
    at: root
    rotation: [0 deg, 90 deg, 0 deg]
    joint: {kind: spherical, stiffness: 0.5 N m/rad, damping: 0.02 N m s/rad}
    loads: {water: {kind: spheroid_added_mass}}
  slide:
    on: swing
    kind: rigid
    shape: cylinder
    length: 0.15 m
    radius: 10 mm
    bend: 60 deg
    density: 1100 kg/m3
    strips: 3
    joint: {kind: prismatic, axis: [1, 2, 0], stiffness: 20 N/m, force: {kind: constant, value: 0.3 N}}
    loads:
      drag: {kind: drag, normal: 1.1, tangential: 0.02, lift: -0.1}
      water: {kind: added_mass, normal: 0.6, tangential: 0.1}
  plate:
    kind: rigid
    shape: cylinder
    length: 0.1 m
    radius: 40 mm
    mass: 0.3 kg
    offset: [0 m, 0.1 m, 0 m]
    joint: {kind: planar, axis: [0, 1, 2], start: {angle: 20 deg}}
    loads: {water: {kind: cylinder_added_mass}}
  crank:
    on: plate
    kind: rigid
    shape: point
    mass: 0.1 kg
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 0.4 rad, frequency: 1.3 Hz, phase: 0.2 rad}}
  arm:
    on: crank
    kind: rod
    section: rectangle
    width: 20 mm
    height: 10 mm
    tip_height: 6 mm
    length: 0.4 m
    young: 0.5 MPa
    poisson: 0.4
    density: 1080 kg/m3
    damping: 100 Pa s
    strains: {torsion: 0, bending_y: 1, bending_z: 0, extension: 0, shear_y: 0, shear_z: 0}
    rest: {bending_z: [2 rad/m, -1 rad/m]}
    points: 4
    marks: [0.4]
    loads:
      drag: {kind: drag, normal: 1.1, lift: 0.2}
      water: {kind: added_mass, normal: 1}
      pull: {kind: force, force: [0 N, 0.1 N, 0.05 N], moment: [0.01 N m, 0 N m, 0 N m], at: tip}
  finger:
    on: arm
    at: 0.4
    kind: rigid
    shape: cylinder
    length: 50 mm
    radius: 5 mm
    density: 1000 kg/m3
    rotation: [0 deg, 0 deg, 90 deg]
    joint: {kind: revolute, axis: y, damping: 1e-3 N m s/rad}
  tail:
    on: arm
    kind: rod
    section: circle
    radius: 4 mm
    length: 0.2 m
    young: 0.2 MPa
    density: 1000 kg/m3
    strains: {bending_y: 0}
    points: 3
    loads: {own: {kind: distributed_force, force: [0 N/m, 0 N/m, 0.2 N/m], frame: body}}
tendons:
  wound:
    {over: {finger: 8 mm}, stiffness: 300 N/m, damping: 2 N s/m, pretension: 1 N, pulled_by: {part: slide, ratio: 0.1}}
  cranked:
    over: {finger: -8 mm}
    stiffness: 300 N/m
    pretension: 3 N
    pulled_by: {part: crank, crank: 20 mm, guide: 50 mm, angle: 70 deg}
"""


@pytest.fixture(scope="session")
def zoo():
    return build(parse_robot(ZOO))


@pytest.fixture(scope="session")
def described():
    """Robot of a text."""
    return lambda text: build(parse_robot(text))


@pytest.fixture(scope="session")
def propeller() -> RobotDescription:
    """The flagellum with few coordinates, in a current."""
    d = describe("flagellum")
    coarse = {"strains": {"torsion": 0, "bending_y": 1, "bending_z": 1}, "points": 5}
    filament = d.limbs["filament"].model_copy(update=coarse)
    water = d.water.model_copy(update={"current": (0.05, 0.02, -0.03)})
    return d.model_copy(update={"water": water, "limbs": {**d.limbs, "filament": filament}})


@pytest.fixture(scope="session")
def propelled(propeller):
    return build(propeller)


@pytest.fixture(scope="session")
def accelerations():
    """Compiled accelerations of the unknown coordinates."""
    compiled = jax.jit(lambda robot, t, x: robot.rates(t, x).v)
    return lambda robot, x, t=0.3: compiled(robot, jnp.asarray(t), x)

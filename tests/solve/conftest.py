import jax.numpy as jnp
import pytest
from tests.small_robots import DRIVEN

from nectosome.core import State
from nectosome.description import RobotDescription, parse_robot
from nectosome.mechanism import make_robot
from nectosome.model import build

ROWING = """
name: rowing boat
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: cylinder
  length: 200 mm
  radius: 40 mm
  mass: 1 kg
  joint: {kind: prismatic, axis: y}
  loads: {drag: {kind: lumped_drag, drag_area: [0 m2, 4e-3 m2, 0 m2]}}
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: 16 g
    joint: {kind: revolute, axis: z, motion: {kind: stroke, amplitude: 60 deg, frequency: 0.8 Hz}}
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
      lower: {stiffness: 10 N m/rad, damping: 0.01 N m s/rad}
    loads: {drag: {kind: plate_drag, normal: 1, start_up: none}}
"""
# a mass point that slides, without any force
SLIDER = """
name: slider
water: {gravity: 0 m/s2}
body: {kind: rigid, shape: point, mass: 2 kg, joint: {kind: prismatic, axis: z}}
"""
FALLING = SLIDER.replace("0 m/s2", "9.81 m/s2")


@pytest.fixture(scope="session")
def driven() -> RobotDescription:
    """A linear oscillator, driven at 1.3 Hz."""
    return parse_robot(DRIVEN)


@pytest.fixture(scope="session")
def boat() -> RobotDescription:
    """A boat with an oar that folds, rowing at 0.8 Hz; its place drifts."""
    return parse_robot(ROWING)


@pytest.fixture(scope="session")
def swinging(pendulum):
    """The pendulum, and its state at rest at an angle [rad] from hanging."""
    robot = build(pendulum)

    def at(angle: float) -> State:
        return State(jnp.array([jnp.pi / 2 + angle]), jnp.zeros(1), robot.initial().z)

    return robot, at


@pytest.fixture(scope="session")
def falling():
    return build(parse_robot(FALLING))


@pytest.fixture(scope="session")
def slider():
    """The slider with further loads on it."""
    bare = build(parse_robot(SLIDER))

    def loaded(*loads):
        return make_robot(bare.tree.parts, loads, bare.water)

    return loaded

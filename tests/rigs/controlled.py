"""Robots under controllers that tests of rigs and of the command line share: their files, loops and a rig."""

from tests.small_robots import SLIDE

# a mass across the slide, which moves with it; neither force accelerates the other along its own axis
ACROSS = """
limbs:
  side:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    volume: 0 m3
    joint: {kind: prismatic, axis: y, stiffness: 5 N/m, damping: 4 N s/m, force: {kind: constant, value: 0 N}}
aliases: {push: body.joint.force.value, swing: limbs.side.joint.force.value}
"""
CROSS = SLIDE.partition("aliases")[0] + ACROSS.lstrip()
ALONG = "{command: push=-2..2 N, measure: body.position, reference: 5 cm, gains: '20, 30, 10'}"
ASIDE = (
    "{command: swing=-2..2 N, measure: side.position, reference: sine, amplitude: 3 cm, frequency: 0.5 Hz, "
    "gains: '0.3, 0.4, 0.1'}"
)
RIG = """
dt: 50 ms
devices:
  tank:
    kind: robot
    robot: cross.yaml
    commands: {a: push, b: swing}
    measurements: {x: {reading: body.position}, y: {reading: side.position}, v: {reading: velocity.x}}
commands:
  tank.a: {low: -3 N, high: 3 N, slew: 200 N/s}
  tank.b: {low: -3 N, high: 3 N, slew: 200 N/s}
measurements:
  tank.x: {least: -50 cm, most: 50 cm, error: 20 cm, follows: tank.a}
  tank.y: {least: -50 cm, most: 50 cm, error: 20 cm, follows: tank.b}
"""
# an arm that shakes the slide, with a beat of 0.5 s
SHAKER = """
limbs:
  arm:
    on: body
    kind: rigid
    shape: point
    mass: 0.3 kg
    centre_of_mass: [0 m, 0.2 m, 0 m]
    volume: 0 m3
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 30 deg, frequency: 2 Hz}}
"""
SHAKEN = SLIDE.replace("aliases", SHAKER.strip() + "\naliases")

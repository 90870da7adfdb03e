"""Small robots: some whose drives repeat themselves, and one that is pushed and sinks."""

from nectosome.description import parse_robot

I, K, C, M0, F = 0.02, 0.8, 0.03, 0.05, 1.3  # kg m2, N m/rad, N m s/rad, N m, Hz
DRIVEN = f"""
name: driven
water: {{gravity: 0 m/s2}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [{I} kg m2, {I} kg m2, {I} kg m2]
  joint:
    kind: revolute
    axis: z
    stiffness: {K} N m/rad
    damping: {C} N m s/rad
    torque: {{kind: sine, amplitude: {M0} N m, frequency: {F} Hz, phase: 0.4 rad}}
aliases:
  c: [body.joint.damping]
  k: [body.joint.stiffness]
  f: [body.joint.torque.frequency]
"""
# a bob on a rod whose hinge is shaken up and down: with this frequency, twice its own, hanging still is unstable
SHAKEN = """
name: shaken
water: {density: 1e-9 kg/m3, gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  volume: 0 m3
  joint: {kind: prismatic, axis: z, motion: {kind: sine, amplitude: 60 mm, frequency: FREQUENCY Hz}}
limbs:
  bob:
    on: body
    kind: rigid
    shape: point
    mass: 1 kg
    inertia: [1 kg m2, 1 kg m2, 1 kg m2]
    centre_of_mass: [0 m, 0 m, -1 m]
    volume: 0 m3
    joint: {kind: revolute, axis: y, position: 1e-3 rad, damping: 0.02 N m s/rad}
"""
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
    loads: {drag: {kind: plate_drag, normal: 1}}
"""
# 2 kg of which 2 L of water carry the weight; a crank of constant thrust, 1 N at 1 rad/s
SUB = parse_robot("""
name: sub
water: {density: 1000 kg/m3, surface: 1 m, floor: 0 m, walls: [0 m, 1 m]}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 2 L
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {kind: planar, axis: [0, -1, 0], start: {position: [0.2 m, 0 m, 0.5 m]}}
  loads:
    jet: {kind: pulsed_thrust, values: [1 N, 1 N, 1 N, 1 N], rated: 1 rad/s, speed: 0 rad/s}
    hull: {kind: wall_contact, reach: 0.1 m, stiffness: 500 N/m, damping: 50 N s/m}
    drag: {kind: lumped_drag, drag_area: [0 m2, 0 m2, 0.2 m2]}
aliases: {jet: body.loads.jet.speed, volume: body.volume}
""")

"""Small robots that the tests of all rooms share: each has a structure of its own, and tests set its numbers.

A program is compiled once a structure in a process: a spring of 1e-30 N/m is none, and compiles nothing anew.
"""

from nectosome.description import parse_robot

PENDULUM = """
name: pendulum
water: {gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: box
  length: 1 m
  width: 20 mm
  height: 100 mm
  mass: 1 kg
  volume: 0 m3
  joint: {kind: revolute, axis: y}
"""
# a soft rod, free in vacuum, that bends, twists and tumbles
DRIFTER = """
name: drifter
water: {gravity: 0 m/s2}
body:
  kind: rod
  section: ellipse
  width: 20 mm
  height: 14 mm
  tip_width: 10 mm
  length: 0.5 m
  young: 50 kPa
  density: 1000 kg/m3
  strains: {torsion: 0, bending_y: 1, bending_z: 0}
  points: 5
  joint:
    kind: free
    start: {angular_velocity: [2 rad/s, 1 rad/s, 4 rad/s], velocity: [0.1 m/s, -0.2 m/s, 0.3 m/s]}
"""
# a hull that goes straight ahead, over a fin of three rays with a web between them
FIN = """
name: fin
body:
  kind: rigid
  shape: spheroid
  length: 100 mm
  radius: 15 mm
  density: 1000 kg/m3
  joint: {kind: prismatic, axis: x}
  loads: {drag: {kind: lumped_drag, drag_area: [2 cm2, 20 cm2, 20 cm2]}}
rays:
  fin:
    at: root
    count: 3
    roots: [[80 mm, 0 mm, -12 mm], [20 mm, 0 mm, -12 mm]]
    tips: [[80 mm, 0 mm, -42 mm], [20 mm, 0 mm, -42 mm]]
    radius: 1 mm
    density: 1000 kg/m3
    motion: {amplitude: 25 deg, frequency: 2 Hz, waves: 0.5}
    web:
      {thickness: 0.5 mm, young: 50 kPa, density: 1000 kg/m3, slack: 0.4,
       loads: {drag: {kind: plate_drag, normal: 1.8, start_up: none}, water: {kind: sheet_added_mass}}}
aliases: {waves: rays.fin.motion.waves, thickness: rays.fin.web.thickness}
"""
# a ball that slides down
BALL = """
name: ball
body:
  kind: rigid
  shape: spheroid
  length: 40 mm
  radius: 20 mm
  density: 1200 kg/m3
  joint: {kind: prismatic, axis: z}
  loads:
    drag: {kind: lumped_drag, drag_area: [1.2e-3 m2, 1.2e-3 m2, 1.2e-3 m2]}
""".lstrip()
# a mass on a spring and a damper, pushed by a force that a controller may hold
SLIDE = """
name: slide
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: point
  mass: 2 kg
  volume: 0 m3
  inertia: [1 kg m2, 1 kg m2, 1 kg m2]
  joint: {kind: prismatic, axis: x, stiffness: 5 N/m, damping: 4 N s/m, force: {kind: constant, value: 0 N}}
aliases: {push: body.joint.force.value, m: body.mass}
"""
LOOSE = 1e-30  # N/m, or N m/rad, of a spring: none

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
  M: [body.joint.torque.amplitude]
  I: [body.inertia.0, body.inertia.1, body.inertia.2]
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
  joint: {kind: prismatic, axis: z, motion: {kind: sine, amplitude: 60 mm, frequency: 0.70486 Hz}}
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
aliases: {f: body.joint.motion.frequency}
"""
BOB = 0.1, 0.02, 9.81, 2e-3, 0.03, 0.5  # kg, m, m/s2; rotor inertia [kg m2], N m/A, ohm


def turning(voltage: str) -> str:
    """Motor of the bob at a constant voltage."""
    winding = f"torque_constant: {BOB[4]} N m/A, resistance: {BOB[5]} ohm, inertia: {BOB[3]} kg m2"
    return f"motor: {{{winding}, voltage: {{kind: constant, value: {voltage}}}}}"


# a bob on an arm that a motor turns in the air, up and down
WHEEL = f"""
name: wheel
water: {{density: 1e-9 kg/m3, gravity: {BOB[2]} m/s2}}
body:
  kind: rigid
  shape: point
  mass: {BOB[0]} kg
  volume: 0 m3
  centre_of_mass: [{BOB[1]} m, 0 m, 0 m]
  joint: {{kind: revolute, axis: y, {turning("1 V")}}}
aliases: {{U: body.joint.motor.voltage.value, J: body.joint.motor.inertia}}
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
# a servo by its data sheet on a battery, with a disc at its shaft
SERVO = """
name: servo on a bench
water: {gravity: 0 m/s2}
batteries: {pack: {voltage: 12 V, resistance: 0.4 ohm}}
body:
  kind: rigid
  shape: point
  mass: 1 kg
  inertia: [0.05 kg m2, 0.05 kg m2, 0.05 kg m2]
  joint:
    kind: revolute
    axis: x
    motion: {kind: sine, amplitude: 30 deg, frequency: 1 Hz}
    servo: {model: XW540-T140-R, battery: pack, full_voltage_at: 12 deg, inertia: 20 g m2}
"""

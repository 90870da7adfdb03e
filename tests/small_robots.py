"""Small robots whose drives repeat themselves."""

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

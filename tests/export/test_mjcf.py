"""Robots as models of MuJoCo: the same motion where both have the same physics, and how far off the water is."""

import jax
import mujoco
import numpy as np
import pytest
from scipy.linalg import eigh

from nectosome.description import parse_robot
from nectosome.export.fluid_fit import fit_fluid
from nectosome.export.mjcf import accelerations, coordinates, mjcf_of
from nectosome.model import build
from nectosome.solve import simulate, static
from nectosome.units import InputError

PENDULUM = """
name: pendulum
body:
  kind: rigid
  shape: box
  length: 300 mm
  width: 20 mm
  height: 40 mm
  mass: 0.5 kg
  volume: 0 m3
  centre_of_mass: [20 mm, 5 mm, -3 mm]
  joint: {kind: revolute, axis: y, position: 50 deg, damping: 0.01 N m s/rad}
limbs:
  lower:
    kind: rigid
    rotation: [0 deg, 20 deg, 30 deg]
    shape: cylinder
    length: 200 mm
    radius: 10 mm
    mass: 0.2 kg
    volume: 0 m3
    joint: {kind: revolute, axis: [0, 0.6, 0.8], position: -30 deg, stiffness: 0.3 N m/rad, rest: 10 deg,
      velocity: 1 rad/s}
  plumb:
    kind: rigid
    on: lower
    shape: point
    mass: 0.1 kg
    volume: 0 m3
    inertia: [1e-4 kg m2, 1e-4 kg m2, 2e-4 kg m2]
    joint: {kind: spherical, damping: 1e-3 N m s/rad, stiffness: 0.02 N m/rad,
      start: {angular_velocity: [1 rad/s, 2 rad/s, 3 rad/s], orientation: [0.1 rad, 0.2 rad, 0.3 rad]}}
"""
FREE = """
name: buoy
body:
  kind: rigid
  shape: cylinder
  length: 300 mm
  radius: 30 mm
  density: 1050 kg/m3
  centre_of_mass: [10 mm, 0 m, -12 mm]
  rotation: [20 deg, 0 deg, 0 deg]
  joint:
    kind: free
    start: {orientation: [40 deg, 0 deg, 0 deg], velocity: [0.1 m/s, 0 m/s, 0.05 m/s],
      angular_velocity: [0.5 rad/s, 0.2 rad/s, 0 rad/s]}
"""
SINKING = """
name: sinking
body:
  kind: rigid
  shape: cylinder
  length: 300 mm
  radius: 15 mm
  density: 1500 kg/m3
  strips: 4
  joint: {kind: free}
  loads: {drag: {kind: drag, normal: 1.1, tangential: 0.05}}
"""
LIGHT = """
name: light
body: {kind: rigid, shape: box, length: 20 mm, width: 10 mm, height: 10 mm, density: 1100 kg/m3, joint: {kind: free}}
limbs:
  fin: {kind: rigid, shape: box, length: 20 mm, width: 5 mm, height: 1 mm, density: 1100 kg/m3,
    joint: {kind: revolute, axis: y}}
  tail: {kind: rigid, at: root, rotation: [0 deg, 0 deg, 180 deg], shape: cylinder, radius: 3 mm, length: 40 mm,
    density: 1100 kg/m3, joint: {kind: spherical}}
"""
SWIMMER = """
name: swimmer
water: {gravity: 0 m/s2}
body:
  kind: rigid
  shape: cylinder
  length: 200 mm
  radius: 20 mm
  density: 1000 kg/m3
  strips: 4
  joint: {kind: planar, axis: z}
  loads: {drag: {kind: drag, normal: 1.2, tangential: 0.02}}
limbs:
  tail:
    kind: rigid
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    shape: cylinder
    length: 150 mm
    radius: 12 mm
    density: 1000 kg/m3
    strips: 4
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 25 deg, frequency: 1 Hz}}
    loads: {drag: {kind: drag, normal: 1.2, tangential: 0.02}}
  fin:
    kind: rigid
    on: tail
    shape: cylinder
    length: 100 mm
    radius: 10 mm
    density: 1000 kg/m3
    strips: 4
    joint: {kind: revolute, axis: z, motion: {kind: sine, amplitude: 35 deg, frequency: 1 Hz, phase: -80 deg}}
    loads: {drag: {kind: drag, normal: 1.2, tangential: 0.02}}
"""
CANTILEVER = """
name: cantilever
body:
  kind: rod
  section: rectangle
  width: 20 mm
  height: 8 mm
  tip_height: 5 mm
  length: 250 mm
  young: 600 kPa
  density: 1300 kg/m3
  strains: {bending_y: 3, torsion: 1}
"""

WET_ROD = """
name: rod
water: {density: 1000 kg/m3, gravity: 0 m/s2}
body:
  kind: rod
  section: circle
  radius: 10 mm
  length: 300 mm
  young: 1 MPa
  density: 1000 kg/m3
  strains: {bending_z: 4}
  joint: {kind: fixed}
  loads:
    water: {kind: added_mass, normal: 1}
"""
SINKING_ROD = """
name: rod
body:
  kind: rod
  section: circle
  radius: 15 mm
  length: 300 mm
  young: 1 MPa
  density: 1500 kg/m3
  strains: {bending_y: 1}
  joint: {kind: free}
  loads:
    water: {kind: added_mass, normal: 1}
    drag: {kind: drag, normal: 1.1, tangential: 0.05}
"""


def written(text):
    description = parse_robot(text)
    robot = build(description)
    return robot, mjcf_of(robot, description)


def moved(model, times, key="start"):
    """Places and velocities of bodies in the world at times, without controls."""
    compiled = mujoco.MjModel.from_xml_string(
        model.text.replace('timestep="0.001"', 'timestep="0.0002"').replace("implicitfast", "RK4")
    )
    data = mujoco.MjData(compiled)
    mujoco.mj_resetDataKeyframe(compiled, data, compiled.key(key).id)
    places = []
    for t in times:
        while data.time < t - 1e-9:
            mujoco.mj_step(compiled, data)
        mujoco.mj_kinematics(compiled, data)
        mujoco.mj_comPos(compiled, data)
        places.append(
            {
                body.name: (data.body(body.name).xmat.reshape(3, 3).copy(), data.body(body.name).xpos.copy())
                for body in model.bodies
            }
        )
    return places


def same_motion(text, seconds, atol, samples=6):
    robot, model = written(text)
    run = simulate(robot, seconds, samples=samples, method="explicit", rtol=1e-9, atol=1e-10)
    diagnosis = run.diagnosis()
    rotation, position = np.asarray(diagnosis.rotation), np.asarray(diagnosis.position)
    for k, there in enumerate(moved(model, np.asarray(run.value.time))):
        for body in model.bodies:
            R, p = there[body.name]
            first = body.stations[0]
            np.testing.assert_allclose(p + R @ body.station_position[0], position[k, first], atol=atol)
            np.testing.assert_allclose(R @ body.station_rotation[0], rotation[k, first], atol=10 * atol)
    return position


def test_hinges_balls_and_springs_move_the_same_in_vacuum():
    """A hinge, a skew hinge with a spring and a ball joint with a spring: to 1e-6 m over a second."""
    position = same_motion(PENDULUM, 1.0, 1e-6)
    assert np.ptp(position[:, -1], axis=0).max() > 0.1


def test_weight_and_buoyancy_act_at_their_own_centres():
    """A body that rights itself and sinks, without drag: to 2e-6 m, as a millionth of its mass sits elsewhere."""
    position = same_motion(FREE, 1.0, 2e-6)
    assert np.ptp(position[:, 0], axis=0).max() > 0.1


def test_dry_friction_of_a_joint_goes_along():
    _, model = written(PENDULUM.replace("damping: 0.01 N m s/rad}", "friction: 0.2 N m}", 1))
    assert mujoco.MjModel.from_xml_string(model.text).dof_frictionloss[0] == 0.2


def test_a_rod_sags_as_a_chain_does():
    """The tip of a tapered cantilever, with the error of 10 cells: within 1 % of its sag."""
    robot, model = written(CANTILEVER)
    sag = float(np.asarray(static(robot).diagnosis().position)[0, -1, 2])
    compiled = mujoco.MjModel.from_xml_string(model.text)
    compiled.dof_damping[:] = 2e-3
    data = mujoco.MjData(compiled)
    for _ in range(20000):
        mujoco.mj_step(compiled, data)
    last = model.bodies[-1]
    tip = data.body(last.name).xpos + data.body(last.name).xmat.reshape(3, 3) @ [250e-3 / 20, 0, 0]
    assert sag < -0.02
    assert tip[2] == pytest.approx(sag, rel=0.01)
    assert compiled.body_mass.sum() == pytest.approx(float(robot.weight().sum()), rel=1e-12)


def test_added_mass_bends_with_a_rod():
    """Clamped, as heavy as the water that it displaces and moves: dry frequencies over the root of 2, Euler-Bernoulli.

    The first three within 1.5 %, with the error of 10 cells; of `armature` the second one would be 1.8 of 4.36 Hz.
    """
    _, model = written(WET_ROD)
    compiled = mujoco.MjModel.from_xml_string(model.text)
    data = mujoco.MjData(compiled)
    mujoco.mj_forward(compiled, data)
    M = np.zeros((compiled.nv, compiled.nv))
    for row, unit in zip(M, np.eye(compiled.nv), strict=True):
        mujoco.mj_mulM(compiled, data, row, unit)
    found = eigh(np.diag(compiled.jnt_stiffness), M, eigvals_only=True)[:3] ** 0.5 / (2 * np.pi)
    EI, per_length = 1e6 * np.pi / 4 * 0.01**4, 1000 * np.pi * 0.01**2
    dry = (np.array([1.87510, 4.69409, 7.85476]) / 0.3) ** 2 * (EI / per_length) ** 0.5 / (2 * np.pi)
    np.testing.assert_allclose(found, dry / 2**0.5, rtol=0.015)


def test_a_sinking_rod_speeds_up_with_its_added_mass():
    """Broadside, from rest: (rho_s + rho_w) A V' = (rho_s - rho_w) g A - rho_w r C_n V^2, so that V = V_e tanh(t/T)."""
    robot, model = written(SINKING_ROD)
    fit = fit_fluid(model, simulate(robot, 0.4, samples=41))
    assert fit.missed_along < 0.01
    area, speed = np.pi * 0.015**2, (500 * np.pi * 0.015 * 9.80665 / (1000 * 1.1)) ** 0.5
    lasts = 2500 * area * speed / (500 * area * 9.80665)
    depth = speed * lasts * np.log(np.cosh(np.array([0.2, 0.4]) / lasts))
    assert -fit.velocity_there[2] == pytest.approx(np.ptp(depth) / 0.2, rel=0.01)
    assert "rods: direction of their added mass, which resists motion along them too" in model.left_out


def test_what_has_no_load_of_the_water_falls_freely():
    """Parts of one density, 0.1 to 2 g: V = g (1 - 1000/1100) t, 2.67 m/s as the mean of 2 to 4 s."""
    robot, model = written(LIGHT)
    fit = fit_fluid(model, simulate(robot, 4.0, samples=41))
    np.testing.assert_allclose(fit.velocity, (0, 0, -9.80665 / 11 * 3), atol=1e-6)
    np.testing.assert_allclose(fit.velocity_there, fit.velocity, atol=1e-3)
    assert np.isnan(fit.missed) and np.isnan(fit.missed_along)  # no force of the water that could be missed


@pytest.mark.parametrize("text", [FREE, SWIMMER])
def test_accelerations_are_those_of_mujocos_velocities(text):
    """Against central differences of qvel over 2 ms of our motion."""
    robot, model = written(text)
    run = simulate(robot, 0.02, samples=21, method="explicit", rtol=1e-10, atol=1e-11)
    complete = jax.jit(jax.vmap(lambda t, x: robot.tree.complete(t, x.q, x.v, robot.solved(t, x)[0])))
    q, v, a = map(np.asarray, complete(run.value.time, run.value.state))
    after, before = (coordinates(model.bodies, q[k], v[k])[1] for k in (11, 9))
    found = accelerations(model.bodies, q[10], v[10], a[10])
    np.testing.assert_allclose(found, (after - before) / 0.002, atol=1e-4 * float(np.abs(found).max()))


def test_drag_of_one_direction_is_met_exactly():
    """A cylinder that sinks broadside, without added mass: MuJoCo's drag has the same form there."""
    robot, model = written(SINKING)
    fit = fit_fluid(model, simulate(robot, 1.0, samples=101))
    assert fit.missed < 0.01
    np.testing.assert_allclose(fit.velocity_there, fit.velocity, atol=0.005 * np.linalg.norm(fit.velocity))
    weight = 500 * np.pi * 0.015**2 * 9.80665
    assert -fit.velocity[2] == pytest.approx((weight / (1000 * 0.015 * 1.1)) ** 0.5, rel=0.02)


def test_a_swimmer_of_hinges_swims_in_mujoco_with_the_fitted_water():
    """Three links with drag alone: a part of the forces is not met, and the speed is less, which is told."""
    robot, model = written(SWIMMER)
    fit = fit_fluid(model, simulate(robot, 3.0, samples=301))
    assert [joint.name for joint in model.carrying] == ["body.x", "body.y"]
    assert all(x >= 0 for own in fit.coefficients.values() for x in own)
    assert fit.missed < 0.3
    assert fit.control.shape == (301, 2)
    assert np.linalg.norm(fit.velocity_there - fit.velocity) < 0.2 * np.linalg.norm(fit.velocity)
    assert np.linalg.norm(fit.velocity) > 0.02


def test_what_mujoco_does_not_take_is_refused_and_told():
    with pytest.raises(InputError, match="plumb: is free against the part that it sits on"):
        written(PENDULUM.replace("kind: spherical, damping: 1e-3 N m s/rad, stiffness: 0.02 N m/rad", "kind: free"))
    with pytest.raises(InputError, match="a loss factor over a band") as told:
        written(WET_ROD.replace("  kind: rod\n", "  kind: rod\n  damping: {loss_factor: 0.1}\n", 1))
    assert told.value.field == "body.damping"
    _, model = written(
        FREE.replace("name: buoy", "name: buoy\nwater: {surface: 0 m, current: [0.1 m/s, 0 m/s, 0 m/s]}")
    )
    assert "water: surface" in model.left_out
    assert 'wind="0.1 0.0 0.0"' in model.text


def test_forces_that_are_not_the_waters_are_told_and_not_fitted():
    """A thrust on the sinking cylinder changes nothing of the coefficients of its drag along the way."""
    pushed = SINKING.replace(
        "tangential: 0.05}",
        "tangential: 0.05}, push: {kind: force, force: [0 N, 0 N, -1 N], moment: [0 N m, 0.15 N m, 0 N m], at: root}",
    )
    robot, model = written(pushed)
    assert model.left_out == model.drives_left_out == ("body: load push, force",)
    fit = fit_fluid(model, simulate(robot, 1.0, samples=101))
    assert fit.missed < 0.01

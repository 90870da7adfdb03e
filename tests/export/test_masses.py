"""Mass properties and added mass as a table: closed forms, and the mass matrix of the robot itself."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nectosome.description import parse_robot
from nectosome.export.body_tree import body_tree_of
from nectosome.export.rigid_bodies import joined_rigidly, mass_properties, rigid_bodies
from nectosome.mechanism import Robot
from nectosome.model import build

FINNED = """
name: finned
water: {gravity: 9.81 m/s2}
body:
  kind: rigid
  shape: spheroid
  length: 400 mm
  radius: 50 mm
  density: 1100 kg/m3
  centre_of_mass: [10 mm, -5 mm, -8 mm]
  offset: [0.2 m, 0.3 m, -1 m]
  rotation: [10 deg, 20 deg, -30 deg]
  joint: {kind: free, start: {orientation: [5 deg, -15 deg, 40 deg], position: [0.1 m, 0 m, 0.2 m]}}
  loads: {water: {kind: spheroid_added_mass}}
limbs:
  fin:
    kind: rigid
    offset: [-100 mm, 40 mm, 10 mm]
    rotation: [20 deg, 0 deg, 70 deg]
    shape: cylinder
    length: 150 mm
    radius: 12 mm
    density: 900 kg/m3
    joint: {kind: revolute, axis: [0.6, 0.8, 0], position: 35 deg}
    loads: {water: {kind: added_mass, normal: 1}}
  tail:
    kind: rod
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    section: circle
    radius: 10 mm
    tip_radius: 5 mm
    length: 200 mm
    young: 100 kPa
    density: 1050 kg/m3
    strains: {bending_z: 1}
    start: {bending_z: [3 rad/m, 1 rad/m]}
    loads: {water: {kind: added_mass, normal: 1}}
"""


@pytest.fixture(scope="module")
def finned():
    return build(parse_robot(FINNED))


def test_the_whole_with_its_joints_held_has_the_mass_matrix_of_the_robot(finned):
    """Its first six rows are those of the body's free joint, whose velocities are along the body's own axes."""
    whole = joined_rigidly(rigid_bodies(finned), "whole")
    M, _ = jax.jit(Robot.mass_bias)(finned, jnp.zeros(()), finned.initial())
    np.testing.assert_allclose(whole.inertia + whole.added, np.asarray(M)[:6, :6], rtol=1e-12, atol=1e-12)


def test_parts_have_their_own_frames(finned):
    """Lamb's coefficients of a spheroid of ratio 4: 0.0816, 0.8598 of the water that it displaces."""
    found = mass_properties(finned)
    body, volume = found.sel(part="body"), 4 / 3 * np.pi * 0.2 * 0.05**2
    assert float(body["mass"]) == pytest.approx(1100 * volume, rel=1e-12)
    assert float(body["volume"]) == pytest.approx(volume, rel=1e-12)
    np.testing.assert_allclose(body["centre_of_buoyancy"], [0.2, 0, 0], atol=1e-15)
    np.testing.assert_allclose(body["centre_of_mass"], [0.21, -0.005, -0.008], atol=1e-15)
    across = 1100 * volume / 5 * (0.2**2 + 0.05**2)
    np.testing.assert_allclose(body["inertia"], np.diag([220 * volume * 2 * 0.05**2, across, across]), atol=1e-15)
    np.testing.assert_allclose(np.diag(body["added_mass"]) / (1000 * volume), [0.0816, 0.8598, 0.8598], atol=1e-4)
    np.testing.assert_allclose(body["added_coupling"], 0.0, atol=1e-15)
    fin = found.sel(part="fin")
    across = 1000 * np.pi * 0.012**2 * 0.15
    np.testing.assert_allclose(np.diag(fin["added_mass"])[1:], across, rtol=1e-12)
    np.testing.assert_allclose(np.diag(fin["added_inertia"])[1:], across * 0.15**2 / 12, rtol=1e-12)
    assert found["inertia"].attrs["units"] == "kg m2"


def test_the_whole_adds_up_in_the_frame_of_the_body(finned):
    """Masses add up; the centre of the fin by hand, through its joint."""
    found = mass_properties(finned)
    own, whole = found.isel(part=slice(-1)), found.sel(part="whole")
    assert float(whole["mass"]) == pytest.approx(float(own["mass"].sum()), rel=1e-14)
    assert float(whole["volume"]) == pytest.approx(float(own["volume"].sum()), rel=1e-14)
    hinge = Rotation.from_rotvec(np.deg2rad(35) * np.array([0.6, 0.8, 0]))
    turned = Rotation.from_euler("xyz", [20, 0, 70], degrees=True) * hinge
    middle = np.array([0.4 - 0.1, 0.04, 0.01]) + turned.apply([0.075, 0, 0])  # it sits on the tip of the body
    fin = joined_rigidly(rigid_bodies(finned)[:2], "both")
    body = found.sel(part="body")
    expected = float(own["mass"][0]) * body["centre_of_mass"].values + float(own["mass"][1]) * middle
    np.testing.assert_allclose(fin.centre_of_mass * fin.mass, expected, atol=1e-14)


def test_a_part_without_weight_and_water_is_told_about_its_origin():
    robot = build(
        parse_robot("name: a\nbody: {kind: rigid, shape: point, mass: 0 kg, volume: 0 m3, joint: {kind: fixed}}")
    )
    found = mass_properties(robot).sel(part="body")
    assert all(np.all(values == 0) for values in found.data_vars.values())


def test_a_filled_tube_with_ribs_has_its_mass_and_stiffness_as_a_chain():
    """Ten hinges of n E I/L with the modulus there; all of its matter and of the water that it displaces."""
    more = (
        "    tip_young: 300 kPa\n    between: [{at: 0.35, young: 200 kPa, density: 1300 kg/m3}]\n    wall: 2 mm\n"
        "    filling: {density: 998 kg/m3}\n    ribs: {count: 8, thickness: 2 mm, radius: 14 mm}\n"
    )
    described = parse_robot(FINNED + more)
    robot, (weighed,) = build(described), [one for one in rigid_bodies(build(described)) if one.name == "tail"]
    chain = [body for body in body_tree_of(robot, described).bodies if body.name.startswith("tail")]
    assert sum(body.inertia[3, 3] for body in chain) == pytest.approx(weighed.inertia[3, 3], rel=2e-3)
    assert sum(body.volume for body in chain) == pytest.approx(weighed.volume, rel=2e-3)
    r = 10e-3 - 5e-3 * 0.35
    outer, inner, rib = (np.pi / 4 * x**4 for x in (r, r - 2e-3, 14e-3))
    EI, share = 200e3 * (outer - inner), 8 * 2e-3 / 0.2
    EI = 1 / ((1 - share) / EI + share / (EI + 100e3 * (rib - outer)))
    (hinge,) = chain[4].joints  # in the middle of the fourth of ten cells
    assert hinge.stiffness == pytest.approx(10 * EI / 0.2, rel=1e-9)

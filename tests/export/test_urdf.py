# ruff: noqa: E501  (tables: one case a line)
"""Robots as URDF: what `nectosome new` reads of the file has the same masses, inertias and places."""

import math

import numpy as np
import pytest

from nectosome.description import import_urdf, parse_robot
from nectosome.export.rigid_bodies import joined_rigidly, rigid_bodies
from nectosome.export.urdf import urdf_of
from nectosome.model import build

ARM = """
name: arm
body:
  kind: rigid
  shape: box
  length: 300 mm
  width: 80 mm
  height: 60 mm
  density: 900 kg/m3
  centre_of_mass: [10 mm, -5 mm, 2 mm]
  joint: {kind: free}
limbs:
  upper:
    kind: rigid
    offset: [-50 mm, 40 mm, 10 mm]
    rotation: [20 deg, 30 deg, -70 deg]
    shape: cylinder
    length: 150 mm
    radius: 12 mm
    mass: 100 g
    inertia: [1e-4 kg m2, 2e-4 kg m2, 2.5e-4 kg m2]
    products: [1e-5 kg m2, -2e-5 kg m2, 3e-5 kg m2]
    joint: {kind: revolute, axis: [0.6, 0.8, 0], damping: 0.02 N m s/rad, friction: 0.03 N m, stiffness: 0.5 N m/rad,
      lower: {at: -40 deg, stiffness: 1 N m/rad}, upper: {at: 50 deg, stiffness: 1 N m/rad}}
  lower:
    kind: rigid
    on: upper
    rotation: [0 deg, -15 deg, 0 deg]
    shape: cylinder
    bend: 40 deg
    length: 120 mm
    radius: 10 mm
    density: 1200 kg/m3
    joint: {kind: prismatic, axis: z}
  hand:
    kind: rigid
    on: lower
    shape: spheroid
    length: 40 mm
    radius: 20 mm
    density: 1000 kg/m3
  eye:
    kind: rigid
    at: root
    shape: point
    mass: 20 g
    volume: 3e-6 m3
    offset: [10 mm, 0 m, 0 m]
"""
TAIL = """
  tail:
    kind: rod
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    section: ellipse
    width: 20 mm
    height: 30 mm
    tip_width: 8 mm
    length: 200 mm
    young: 100 kPa
    density: 1050 kg/m3
    strains: {bending_y: 0, bending_z: 1, extension: 0}
    rest: {bending_z: [4 rad/m, 1 rad/m]}
  fluke:
    kind: rigid
    on: tail
    shape: box
    length: 30 mm
    width: 2 mm
    height: 60 mm
    density: 1000 kg/m3
"""


@pytest.fixture
def again(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)

    def again(text):
        description = parse_robot(text)
        robot = build(description)
        found = urdf_of(robot, description)
        (tmp_path / "robot.urdf").write_text(found.text)
        return robot, found, import_urdf("robot.urdf")

    return again


def relative(robot, names):
    bodies = {body.name: body for body in rigid_bodies(robot)}
    root = bodies["body"]
    return [
        (root.rotation.T @ bodies[n].rotation, (bodies[n].position - root.position) @ root.rotation, bodies[n].inertia)
        for n in names
    ]


def test_masses_inertias_and_places_come_back(again):
    robot, found, back = again(ARM)
    names = ["body", "upper", "lower", "hand", "eye"]
    for ours, theirs in zip(relative(robot, names), relative(build(back.description), names), strict=True):
        for a, b in zip(ours, theirs, strict=True):
            np.testing.assert_allclose(a, b, rtol=1e-13, atol=1e-16)
    limbs = back.description.limbs
    assert (limbs["upper"].joint.kind, limbs["lower"].joint.kind, limbs["hand"].joint.kind) == (
        "revolute", "prismatic", "fixed")  # fmt: skip
    np.testing.assert_allclose(limbs["upper"].joint.axis, [0.6, 0.8, 0], rtol=1e-15)
    assert (limbs["upper"].joint.damping, limbs["upper"].joint.friction) == (0.02, 0.03)
    assert f'lower="{math.radians(-40)}" upper="{math.radians(50)}"' in found.text
    assert "upper.angle: spring of 0.5 N m/rad" in found.left_out
    volumes = {
        name: float(v)
        for name, v in zip(build(back.description).tree.names, _volumes(build(back.description)), strict=True)
    }
    assert volumes["body_shape"] == pytest.approx(0.3 * 0.08 * 0.06, rel=1e-14)
    assert volumes["hand_shape"] == pytest.approx(4 / 3 * np.pi * 0.02**3, rel=1e-14)


def _volumes(robot):
    return [robot.tree.stations.volume[place.stations].sum() for place in robot.tree.layout]


def test_a_rod_is_a_chain_of_links_that_weighs_the_same(again):
    """Twenty hinges in turn about y and z; straight at rest the whole has the inertia of the rod itself."""
    straight = (ARM + TAIL).replace("[4 rad/m, 1 rad/m]", "[1e-15 rad/m, 1e-15 rad/m]")  # the structure of the bent one
    robot, found, back = again(straight)
    chained = build(back.description)
    ours, theirs = (joined_rigidly(rigid_bodies(one), "whole") for one in (robot, chained))
    np.testing.assert_allclose(theirs.inertia, ours.inertia, rtol=1e-12, atol=1e-16)
    hinged = [name for name in chained.coordinate_names if name.startswith("tail")]
    assert len(hinged) == 20
    assert "tail: extension, which is held" in found.left_out
    half_width = 0.5 * (0.020 - 0.012 * 1.5 / 20)  # at the second place of 20, the first one about z
    stiffness = 100e3 * np.pi / 4 * 0.015 * half_width**3 / 0.02
    assert f"tail.bending_z.2: spring of {stiffness:.4g} N m/rad" in found.left_out


def test_a_rod_that_is_bent_at_rest_has_its_tip_there(again):
    """To the second order in the length of a cell: 10 of them are within 0.5 % of its length."""
    robot, _, back = again(ARM + TAIL)
    ours, theirs = (next(b for b in rigid_bodies(r) if b.name == "fluke") for r in (robot, build(back.description)))
    body = rigid_bodies(robot)[0]
    np.testing.assert_allclose((ours.position - body.position) @ body.rotation, theirs.position, atol=0.005 * 0.2)
    np.testing.assert_allclose(body.rotation.T @ ours.rotation, theirs.rotation, atol=2e-3)


@pytest.mark.parametrize(
    ("joint", "kind"), [("free", "free"), ("revolute, axis: y", "revolute"), ("planar, axis: z", "planar"), ("fixed", "fixed")]
)  # fmt: skip
def test_what_holds_the_body_comes_back(again, joint, kind):
    _, found, back = again(
        ARM.replace(
            "joint: {kind: free}",
            f"joint: {{kind: {joint}}}\n  offset: [1 m, 2 m, 3 m]\n  rotation: [0 deg, 0 deg, 30 deg]",
        )
    )
    body = back.description.body
    assert (body.joint.kind, body.offset) == (kind, (1.0, 2.0, 3.0))
    np.testing.assert_allclose(body.rotation, (0, 0, math.pi / 6), atol=1e-15)
    assert body.mass == pytest.approx(0.3 * 0.08 * 0.06 * 900)
    assert not any("where it is in the world" in words for words in found.left_out)


def test_limbs_without_a_body_come_back_on_the_world(again):
    arms = "limbs:\n" + "".join(
        f"  {name}: {{kind: rigid, shape: box, length: 0.1 m, width: 20 mm, height: 20 mm, density: 900 kg/m3,"
        f" offset: [0 m, {y} m, 0 m], joint: {{kind: revolute, axis: z}}}}\n"
        for name, y in (("left", 0.2), ("right", -0.2))
    )
    _, _, back = again(f"name: two\n{arms}")
    limbs = back.description.limbs
    assert back.description.body is None
    assert [(limbs[name].on, limbs[name].offset[1]) for name in ("left", "right")] == [("world", 0.2), ("world", -0.2)]

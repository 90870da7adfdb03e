"""Loads and drives that a user adds to a robot: all that it had stays, and what cannot be added gets a sentence."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import JointLoad, Load, PairLoad, RodLoad, State
from nectosome.core.described import number
from nectosome.description import parse_robot
from nectosome.description.drives import MotorDrive
from nectosome.drives import VoltageMotor
from nectosome.mechanism import Robot, diagnose, load_names, make_robot
from nectosome.model import build
from nectosome.units import InputError

# a hull with two arms that a bushing and a tendon join, a motor on a battery, and a rod behind it; its bow is at -x
OARED = """
name: oared
forward: -x
water: {gravity: 0 m/s2}
batteries: {pack: {voltage: 6 V, resistance: 0.1 ohm}}
body:
  kind: rigid
  shape: box
  length: 0.2 m
  width: 40 mm
  height: 30 mm
  density: 1000 kg/m3
  joint: {kind: planar, axis: z}
limbs:
  left:
    on: body
    offset: [0 m, 20 mm, 0 m]
    kind: rigid
    shape: cylinder
    length: 80 mm
    radius: 5 mm
    density: 1100 kg/m3
    joint: {kind: revolute, axis: z, stiffness: 0.1 N m/rad}
    loads: {drag: {kind: drag, normal: 1.1}}
  right:
    on: body
    offset: [0 m, -20 mm, 0 m]
    kind: rigid
    shape: cylinder
    length: 80 mm
    radius: 5 mm
    density: 1100 kg/m3
    joint: {kind: revolute, axis: z}
  crank:
    on: body
    kind: rigid
    shape: point
    mass: 10 g
    inertia: [1e-5 kg m2, 1e-5 kg m2, 1e-5 kg m2]
    joint:
      kind: revolute
      axis: z
      motor:
        torque_constant: 0.02 N m/A
        resistance: 1.5 ohm
        inertia: 1e-4 kg m2
        battery: pack
        voltage: {kind: constant, value: 3 V}
  tail:
    on: body
    at: root
    rotation: [0 deg, 0 deg, 180 deg]
    kind: rod
    section: circle
    radius: 5 mm
    length: 0.1 m
    young: 1 MPa
    density: 1000 kg/m3
    strains: {bending_z: 0}
    points: 4
pairs: {link: {kind: bushing, between: [left, right], at: [tip, tip], stiffness: 5 N/m, damping: 0.1 N s/m}}
tendons: {cord: {over: {left: 5 mm, right: -5 mm}, stiffness: 2 kN/m, damping: 0 N s/m, pretension: 1 N}}
"""


class Idle(Load):
    """No force, and a state that stays."""

    def initial(self):
        return jnp.ones(2)

    def force(self, t, strips, z, water):
        return jnp.zeros((strips.weight.shape[0], 6)), jnp.zeros(2)


class IdleHinge(JointLoad):
    def force(self, displacement, v):
        return 0 * v


class IdleMuscle(RodLoad):
    def force(self, t, q, v):
        return 0 * v


class IdleLink(PairLoad):
    def force(self, first, second):
        return jnp.zeros((first.weight.shape[0], 6)), jnp.zeros((second.weight.shape[0], 6))

    def energy(self, first, second):
        return jnp.zeros(())


class SideDrag(Load):
    """F = -c v across the part, on its first station."""

    c: jax.Array
    on_first = dissipative = True

    def force(self, t, strips, z, water):
        return strips.at_first(jnp.zeros(6).at[4].set(-self.c * strips.velocity[0, 1])), z


@pytest.fixture(scope="module")
def oared() -> Robot:
    return build(parse_robot(OARED))


def residual(robot: Robot, seed: int = 3) -> np.ndarray:
    q, v, a = np.random.default_rng(seed).normal(0.0, 0.1, (3, robot.start.v.size))
    x = State(robot.start.q + q, jnp.asarray(v), robot.start.z)
    return np.asarray(jax.jit(Robot.residual)(robot, jnp.asarray(0.3), x, jnp.asarray(a)))


def idle(robot: Robot) -> Robot:
    """With a load of each kind that does nothing, and a motor without voltage at a hinge."""
    still = MotorDrive(voltage={"kind": "constant", "value": 0.0}, torque_constant=1e-12, resistance=1.0, inertia=0.0)
    robot = robot.with_load("left", Idle()).with_load("left", IdleHinge()).with_load("tail", IdleMuscle())
    robot = robot.with_load(("tail", "crank"), IdleLink(), "string")
    return robot.with_drive("left", VoltageMotor.from_description(still), "pack")


def test_a_robot_with_loads_and_a_drive_that_do_nothing_moves_as_before(oared):
    """It keeps its pairs, its motor and battery, its tendon and its forward axis."""
    more = idle(oared)
    np.testing.assert_allclose(residual(more), residual(oared), rtol=1e-12, atol=1e-12)
    assert more.description is None
    assert (more.forward, more.tendon_names, more.powered.battery_names) == ("-x", ("cord",), ("pack",))
    assert {*load_names(more)} - {*load_names(oared)} == {"idle", "idle_hinge", "idle_muscle", "string"}
    assert len(more.powered.groups) == 2
    assert float(more.body_length) == float(oared.body_length)
    np.testing.assert_array_equal(more.added, oared.added)
    assert [z.shape for z in jax.tree.leaves(more.start.z)] == [(1, 2)]


def test_an_own_load_acts_where_it_is_put(oared):
    """Across the hull, at its middle 0.1 m from the joint: c v, its moment, and nothing else."""
    drag = oared.with_load("body", SideDrag(number(3.0)), "keel")
    x = State(oared.start.q, jnp.zeros_like(oared.start.v).at[oared.coordinate_names.index("body.y")].set(0.2), ())
    bare, mine = (jax.jit(diagnose)(r, jnp.zeros(()), State(x.q, x.v, r.start.z), 0 * x.v) for r in (oared, drag))
    pushed = dict(zip(oared.coordinate_names, np.asarray(mine.missing - bare.missing), strict=True))
    assert pushed.pop("body.y") == pytest.approx(3.0 * 0.2, rel=1e-12)
    assert pushed.pop("body.angle") == pytest.approx(0.1 * 3.0 * 0.2, rel=1e-12)
    assert not any(pushed.values())
    assert float(mine.load_power[load_names(drag).index("keel"), 0]) == pytest.approx(-3.0 * 0.04, rel=1e-12)


def test_parts_of_a_robot_that_would_lose_what_else_it_has_are_refused(oared):
    tree, loads, water = oared.tree, oared.loads, oared.water
    lost = "pair link, tendon cord, battery pack, motor of crank, forward axis -x"
    with pytest.raises(InputError, match=rf"would be lost: {lost}\. Add a load by robot\.with_load\(part, load\)"):
        make_robot(tree.parts, loads, water)
    with pytest.raises(InputError, match=r"would be lost: pair link, tendon cord\. "):
        make_robot([replace(tree.one(0), name="hull"), *tree.parts[1:]], loads, water, (), oared.powered, (), "-x")
    hull = build(parse_robot(OARED[: OARED.index("batteries")] + OARED[OARED.index("body:") : OARED.index("limbs:")]))
    same = make_robot(hull.tree.parts, hull.loads, hull.water, forward="-x")
    np.testing.assert_array_equal(residual(same), residual(hull))


@pytest.mark.parametrize(
    ("add", "said"),
    [
        (lambda r: r.with_load("lefd", Idle()), r'part: there is no part "lefd"\. Did you mean "left"'),
        (lambda r: r.with_load(3, Idle()), r'part: there is no part "3"\.'),
        (lambda r: r.with_load("left", Idle), "load: .* is given where a load is expected"),
        (lambda r: r.with_load(("left", "tail"), Idle()), 'part: Idle acts on one part, as in "body"'),
        (lambda r: r.with_load("left", IdleLink()), r"part: IdleLink acts on two parts"),
        (lambda r: r.with_load("left", IdleMuscle()), "part: left is no rod"),
        (lambda r: r.with_load("tail", IdleHinge()), "part: tail has a joint that does not move"),
        (lambda r: r.with_load("left", Idle(), "drag"), 'name: "drag" is a row of results already'),
        (lambda r: r.with_load("left", Idle(), "weight"), 'name: "weight" is a row of results already'),
        (lambda r: r.with_drive("left", Idle()), "drive: .* is given where a drive is expected"),
        (lambda r: r.with_drive("crank", r.powered.groups[0].drive), "part: the joint of crank .* a motor already"),
        (lambda r: r.with_drive("body", r.powered.groups[0].drive), "part: the joint of body is not free to turn"),
        (lambda r: r.with_drive("left", r.powered.groups[0].drive, "pak"), r'there is no battery "pak"\. Did you mean'),
    ],
)
def test_what_cannot_be_added_gets_a_sentence(as_users_run, oared, add, said):
    with pytest.raises(InputError, match=said):
        add(oared)

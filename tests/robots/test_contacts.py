"""Robots whose parts touch: what carries weight, what holds and slips, and what a pair must keep."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.core import State, Status
from nectosome.core.programs.remember import remembered
from nectosome.description import parse_robot, with_values
from nectosome.mechanism import diagnose, load_names, reduced
from nectosome.model import bind, build
from nectosome.solve import load_stepping, simulate, static
from nectosome.solve.symmetry import find_symmetry

# a soft rod that lies across a log, free to go up and down and to bend
RESTING = """
name: rod on a log
water: {density: 1000 kg/m3}
body:
  kind: rigid
  shape: cylinder
  length: 200 mm
  radius: 20 mm
  mass: 1 kg
  rotation: [0 rad, 0 rad, 90 deg]
  offset: [0 m, -100 mm, 0 m]
limbs:
  rod:
    on: body
    at: root
    offset: [100 mm, 60 mm, 24.5 mm]
    rotation: [0 rad, 0 rad, -90 deg]
    kind: rod
    section: circle
    length: 120 mm
    radius: 5 mm
    young: 1 MPa
    density: 2000 kg/m3
    damping: 1000 Pa s
    strains: {bending_y: 2}
    points: 20
    joint: {kind: prismatic, axis: z, damping: 0.2 N s/m}
pairs:
  contact: {kind: contact, between: [rod, body], stiffness: 5 kN/m, damping: 20 N s/m, softness: 0.2 mm}
"""
WEIGHT = 1000 * np.pi * 0.005**2 * 0.12 * 9.80665


def contact_force(robot, x, part: str) -> np.ndarray:
    d = remembered(diagnose, robot, jnp.zeros(()), x)
    return np.asarray(d.load_force[load_names(robot).index("contact"), robot.tree.part(part)])


def test_a_rod_that_lies_on_a_log_presses_on_it_with_its_weight():
    robot = build(parse_robot(RESTING))
    assert reduced(robot) is robot
    x = load_stepping(robot)
    assert int(x.status) == Status.SOLVED
    held = contact_force(robot, x.value, "rod")
    assert held[2] == pytest.approx(WEIGHT, rel=1e-9)
    np.testing.assert_allclose(contact_force(robot, x.value, "body"), -held, rtol=1e-12, atol=1e-15)


@pytest.mark.slow
def test_a_rod_that_falls_on_a_log_comes_to_rest_there():
    description = parse_robot(RESTING.replace("24.5 mm", "27 mm"))
    run = simulate(build(description), 2.0, samples=41)
    assert int(run.status) == Status.SOLVED
    data = run.to_dataset()
    pushed = data["load_force"].sel(load="contact", part="rod", axis="z").values
    assert pushed[0] == 0
    assert pushed[-1] == pytest.approx(WEIGHT, rel=1e-3)
    assert float(data["power_balance"].max()) < 1e-12


# a ball of 1 kg on a level rail, which pulls it to the side
ON_A_RAIL = """
name: ball on a rail
water: {density: 1e-6 kg/m3}
body: {kind: rigid, shape: cylinder, length: 4 m, radius: 50 mm, mass: 1 kg, offset: [-2 m, 0 m, -50 mm]}
limbs:
  lift:
    on: body
    at: root
    offset: [2 m, 0 m, 50 mm]
    kind: rigid
    shape: point
    mass: 0.5 kg
    joint: {kind: prismatic, axis: z, position: 49 mm}
  ball:
    on: lift
    at: root
    kind: rigid
    shape: spheroid
    length: 100 mm
    radius: 50 mm
    mass: 0.5 kg
    joint: {kind: prismatic, axis: x}
    loads: {pull: {kind: force, force: [PULL N, 0 N, 0 N], at: root}}
pairs:
  contact:
    kind: contact
    between: [ball, body]
    stiffness: 1e4 N/m
    damping: 200 N s/m
    softness: 0.1 mm
    static_friction: 0.5
    dynamic_friction: 0.3
    creep: 1 mm/s
"""


def slid(share: float):
    """Run of a ball pulled by a share of what holds it: mu_s times its weight."""
    pull = share * 0.5 * 9.80665
    run = simulate(build(parse_robot(ON_A_RAIL.replace("PULL", f"{pull}"))), 0.5, samples=11)
    assert int(run.status) == Status.SOLVED
    return run.to_dataset(), pull


def test_friction_holds_below_its_cone():
    """It creeps by less than the 1 mm/s of the contact; the friction is what pulls."""
    data, pull = slid(0.9)
    assert 0 < float(data["v"].sel(coordinate="ball.position")[-1]) < 1e-3
    assert float(data["load_force"].sel(load="contact", part="ball", axis="x")[-1]) == pytest.approx(-pull, rel=1e-3)


def test_friction_slips_above_its_cone():
    """It is off with (F - mu_d m g)/m of the half of the mass that slides."""
    data, pull = slid(1.1)
    a = (pull - 0.3 * 9.80665) / 0.5
    assert float(data["a"].sel(coordinate="ball.position")[-1]) == pytest.approx(a, rel=1e-3)
    assert float(data["load_power"].sel(load="contact").sum("part")[-1]) < 0


# two rods on a free hull that swing into each other
CLAPPING = """
name: clapping
water: {gravity: 0 m/s2, density: 1e-9 kg/m3}
body:
  kind: rigid
  shape: cylinder
  length: 50 mm
  radius: 20 mm
  mass: 50 g
  joint: {kind: free, start: {angular_velocity: [1 rad/s, 2 rad/s, -1 rad/s], velocity: [0.1 m/s, 0 m/s, 0.2 m/s]}}
limbs:
  left: &arm
    on: body
    offset: [0 m, 10 mm, 0 m]
    kind: rod
    section: circle
    length: 150 mm
    radius: 5 mm
    tip_radius: 3 mm
    young: 300 kPa
    density: 1000 kg/m3
    strains: {torsion: 0, bending_y: 1, bending_z: 1}
    points: 4
    joint: {kind: revolute, axis: z, velocity: -8 rad/s}
  right:
    on: body
    offset: [0 m, -10 mm, 0 m]
    kind: rod
    section: circle
    length: 150 mm
    radius: 5 mm
    young: 300 kPa
    density: 1000 kg/m3
    strains: {torsion: 0, bending_y: 1, bending_z: 1}
    points: 4
    joint: {kind: revolute, axis: z, velocity: 4 rad/s}
pairs:
  contact: {kind: contact, between: [left, right], stiffness: 300 N/m, damping: 0.5 N s/m, softness: 1 mm,
    static_friction: 0.5, dynamic_friction: 0.4, creep: 10 mm/s}
  elbow: {kind: bushing, between: [left, body], at: [tip, root], stiffness: 2 N/m, damping: 0.01 N s/m,
    turning_stiffness: 0.01 N m/rad, turning_damping: 1e-4 N m s/rad}
"""


@pytest.fixture(scope="module")
def clapping():
    """Robot, run, its data, and how hard the rods push each other [N]."""
    robot = build(parse_robot(CLAPPING.replace("&arm", "")))
    run = simulate(robot, 0.05, samples=26, rtol=1e-6, atol=1e-9)
    data = run.to_dataset()
    return robot, run, data, np.linalg.norm(data["load_force"].sel(load="contact", part="left").values, axis=-1)


def test_contact_within_a_free_robot_changes_no_momentum(clapping):
    """To the steps' tolerance over a run; and the powers balance."""
    _, _, data, pushed = clapping
    assert pushed[0] == 0
    assert pushed.max() > 0.1
    assert float(data["load_power"].sel(load="contact").sum("part").min()) < 0
    assert float(data["power_balance"].max()) < 1e-12
    for name in ("momentum", "angular_momentum"):
        kept = data[name].values
        np.testing.assert_allclose(kept, np.broadcast_to(kept[0], kept.shape), atol=1e-4 * np.linalg.norm(kept[0]))


def test_momentum_does_not_change_while_parts_touch(clapping):
    """In single states, to rounding."""
    robot, run, _, pushed = clapping

    @jax.jit
    def rates(x):
        def momenta(x):
            d = diagnose(robot, jnp.zeros(()), x)
            return d.momentum, d.angular_momentum

        return jax.jvp(momenta, (x,), (robot.rates(jnp.zeros(()), x),))[1]

    for k in np.flatnonzero(pushed > 0.1)[:3]:
        for rate in rates(jax.tree.map(lambda x, k=k: x[k], run.value.state)):
            np.testing.assert_allclose(rate, 0, atol=1e-11 * pushed[k])


def test_what_acts_within_a_robot_leaves_its_symmetries(clapping):
    """Place and heading of a free robot count for nothing: six directions to drift in."""
    symmetry = find_symmetry(clapping[0])
    assert symmetry.drift == (0, 1, 2, 3, 4, 5)
    assert symmetry.steady


def test_a_pair_can_be_swept_and_has_slopes():
    """How deep a ball is in its rail, by the contact's stiffness: m g/k beyond half of the softness."""
    theta, make = bind(parse_robot(ON_A_RAIL.replace("PULL", "0")), ("pairs.contact.stiffness",))

    def height(theta):
        robot = make(theta)
        x = State(jnp.array([0.049, 0.0]), jnp.zeros(2), robot.initial().z)
        return robot.residual(jnp.zeros(()), x, jnp.zeros(2))[0]

    depth = 1e-3
    assert float(jax.jit(jax.grad(height))(theta)[0]) == pytest.approx(-(depth - 0.5e-4), rel=1e-9)


@pytest.mark.parametrize(("deep", "told"), [(0.9, False), (1.3, True)])
def test_a_contact_that_is_too_soft_to_hold_is_told(deep: float, told: bool):
    """1 kg sinks m g/k into the rail, beyond half of the softness; its thinner part has a radius of 50 mm."""
    text = ON_A_RAIL.replace("    joint: {kind: prismatic, axis: x}\n", "").replace("PULL", "0")
    stiffness, damping = 9.80665 / (deep * 0.05 - 0.5e-4), 2.0
    robot = with_values(parse_robot(text), {"pairs.contact.stiffness": stiffness, "pairs.contact.damping": damping})
    rests = static(robot)
    assert int(rests.status) == Status.SOLVED
    assert float(rests.state.q[0]) == pytest.approx(0.05 * (1 - deep), abs=1e-9)
    says = f"ball and body are in one another by {deep} times the radius of the thinner one"
    assert any(says in words for words in rests.summary().cautions) is told
    falls = simulate(robot, 0.4, samples=21).summary()  # it swings about that depth
    assert any("raise pairs.contact.stiffness" in words for words in falls.cautions)

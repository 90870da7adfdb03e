"""Limbs on the world, and joints and strains that follow recordings, as robots: poses, reactions, periods."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from nectosome.description import drive_period, dump_robot, parse_robot
from nectosome.model import build
from nectosome.units import InputError

ROD = "kind: rod, section: circle, length: 0.2 m, radius: 5 mm, young: 1 MPa, density: 1 g/cm3, strains: {bending_y: 2}"
ARM = "kind: rigid, shape: cylinder, length: 0.3 m, radius: 1 cm, mass: 0.1 kg"
TIMES = np.linspace(0.0, 2.0, 41)


def recording(values, unit: str) -> str:
    times = ", ".join(f"{t} s" for t in TIMES.tolist())
    samples = ", ".join(f"{u} {unit}" for u in np.asarray(values).tolist())
    return f"{{kind: recording, times: [{times}], values: [{samples}]}}"


def test_a_limb_on_the_world_moves_as_a_body_does():
    """A pendulum, as the body and as a limb without one: the same equations, another name."""
    joint = "joint: {kind: revolute, axis: y, position: 20 deg}, offset: [0, 0, 1 m], rotation: [0, 30 deg, 0]"
    body = build(parse_robot(f"name: a\nbody: {{{ARM}, {joint}}}\n"))
    limb = build(parse_robot(f"name: a\nlimbs: {{arm: {{{ARM}, {joint}}}}}\n"))
    assert [*limb.coordinate_names] == ["arm.angle"]
    residual = jax.jit(lambda robot: robot.residual(jnp.zeros(()), robot.initial(), jnp.ones(1)))
    np.testing.assert_array_equal(residual(body), residual(limb))


def test_limbs_on_the_world_are_repeated_and_mirrored_in_its_axes():
    found = parse_robot(
        f"name: a\nlimbs:\n  arm: {{{ARM}, offset: [10 cm, 5 cm, 0], repeat: {{mirror: y}}}}\n"
        f"  hand: {{on: arm, {ARM}}}\n"
    )
    assert [*found.parts] == ["arm1", "arm2", "hand1", "hand2"]
    assert found.parts["arm2"].offset == (0.1, -0.05, 0.0)
    assert [limb.on for limb in found.parts.values()] == ["world", "world", "arm1", "arm2"]
    assert parse_robot(dump_robot(found)) == found
    tree = build(found).tree
    assert [part.parent for part in tree.parts] == [-1, -1, 0, 1]
    shape = tree.shape(build(found).initial().q)
    np.testing.assert_allclose(shape.position[:, 1].min(), -0.05, atol=1e-12)


def test_a_robot_with_a_body_may_have_limbs_on_the_world_too():
    text = (
        f"name: a\nbody: {{{ARM}, joint: {{kind: free}}}}\nlimbs: {{post: {{on: world, {ARM}, offset: [1 m, 0, 0]}}}}\n"
    )
    robot = build(parse_robot(text))
    assert [part.parent for part in robot.tree.parts] == [-1, -1]
    post = robot.tree.layout[1].stations
    assert robot.tree.shape(robot.initial().q).position[post.start, 0] == pytest.approx(1.15)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("name: a\n", "body: is missing. Give a body, or limbs that sit on the world."),
        (f"name: a\nlimbs: {{world: {{{ARM}}}}}\n", "limbs.world: a limb cannot be called world."),
        (f"name: a\nlimbs: {{a: {{{ARM}, on: body}}}}\n", 'limbs.a.on: there is no part "body" before this one.'),
        (f"name: a\nlimbs: {{a: {{{ARM}, at: 0.5}}}}\n", "limbs.a.at: world has no mark at 0.5."),
    ],
)
def test_what_cannot_sit_on_the_world_is_told(text, message):
    with pytest.raises(InputError) as caught:
        parse_robot(text)
    assert message in str(caught.value)


def test_a_recorded_hinge_takes_the_torque_of_the_motion_that_was_recorded():
    """Samples of a sine, every 50 ms: the reaction within 0.1 % of the sine's, by inverse dynamics."""
    amplitude, f = 0.3, 0.5
    sine = f"{{kind: sine, amplitude: {amplitude} rad, frequency: {f} Hz}}"
    recorded = recording(amplitude * np.sin(2 * np.pi * f * TIMES), "rad")
    reactions = []
    for motion in (sine, recorded):
        robot = build(parse_robot(f"name: a\nbody: {{{ARM}, joint: {{kind: revolute, axis: y, motion: {motion}}}}}\n"))
        force = jax.jit(lambda robot: robot.forces(jnp.asarray(0.731), robot.initial(), jnp.zeros(0)).residual)
        reactions.append(np.asarray(force(robot)))
    assert np.all(np.abs(reactions[0]) > 1e-4)
    np.testing.assert_allclose(reactions[1], reactions[0], rtol=1e-3)


def test_a_recorded_curvature_is_that_of_the_rod():
    values = 2.0 * np.sin(np.pi * TIMES)
    motion = f"motion: {{bending_y: {recording(values, 'rad/m').replace('{kind', '{envelope: [0, 1], kind')}}}"
    robot = build(parse_robot(f"name: a\nbody: {{{ROD}, {motion}}}\n"))
    q, v, a = robot.tree.complete(jnp.asarray(0.5), jnp.zeros(0), jnp.zeros(0))
    # a curvature that grows evenly to 2 rad/m at the tip, over 0.2 m: 0.2 (1 + P1) and its rate, which is 0 then
    np.testing.assert_allclose(q, [0.2, 0.2, 0.0], atol=1e-6)
    np.testing.assert_allclose(v, 0.0, atol=1e-4)
    np.testing.assert_allclose(a, -(np.pi**2) * np.array([0.2, 0.2, 0.0]), atol=1e-2)


def test_a_recorded_motion_has_no_period():
    text = f"name: a\nbody: {{{ARM}, joint: {{kind: revolute, axis: y, motion: {recording(TIMES, 'rad')}}}}}\n"
    with pytest.raises(InputError, match="a recording does not repeat itself"):
        drive_period(parse_robot(text))

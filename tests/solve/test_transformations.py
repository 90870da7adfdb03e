"""The public verbs under jit, vmap and derivatives: one directional derivative each against finite differences."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from tests.small_robots import BALL, DRIVEN, PENDULUM

import nectosome as ns
from nectosome.core import State, Status
from nectosome.description import parse_robot
from nectosome.units import InputError

TIGHT = {"rtol": 1e-9, "atol": 1e-11}
HELD = PENDULUM.replace("axis: y", "axis: y, stiffness: 30 N m/rad")
SINGLE = ("body.length", "body.mass")
DRAG = ("body.density", "body.loads.drag.drag_area.2")

# robot, quantities, what comes of a built robot, the step of differences, and whether reverse mode works
VERBS = {
    "simulate": (PENDULUM, SINGLE, lambda r: ns.simulate(r, 0.5, samples=3, **TIGHT).value.state.q[-1, 0], 1e-5, False),
    "static": (HELD, SINGLE, lambda r: ns.static(r).value.state.q[0, 0], 1e-5, True),
    "steady": (BALL, DRAG, lambda r: ns.steady(r).speed, 1e-5, True),
    "periodic": (DRIVEN, ("k", "f"), lambda r: ns.periodic(r, rtol=1e-9).value.state.q[0, 0], 1e-4, False),
    "forces": (PENDULUM, SINGLE, lambda r: ns.forces(r, {"body.angle": 0.4})["missing_force"].data[0], 1e-5, True),
    "reading": (
        PENDULUM,
        SINGLE,
        lambda r: ns.reading(ns.simulate(r, 0.5, samples=3, **TIGHT), "body.tip.pitch")[-1],
        1e-5,
        False,
    ),
}


def verb(name: str):
    """Function of its quantities, where it is tried, and a direction."""
    text, quantities, of, step, reverse = VERBS[name]
    theta, build = ns.bind(parse_robot(text), quantities)
    return lambda theta: of(build(theta)), theta, theta * jnp.array([0.3, -0.2]), step, reverse


@pytest.mark.parametrize("name", VERBS)
def test_the_derivative_of_a_verb_is_that_of_finite_differences(name):
    f, theta, along, h, reverse = verb(name)
    value, slope = jax.jvp(f, (theta,), (along,))
    assert float(value) == pytest.approx(float(f(theta)), rel=1e-9)
    differences = (float(f(theta + h * along)) - float(f(theta - h * along))) / (2 * h)
    assert float(slope) == pytest.approx(differences, rel=1e-6)
    if reverse:
        assert float(jax.jit(jax.grad(f))(theta) @ along) == pytest.approx(float(slope), rel=1e-9)


@pytest.mark.parametrize("name", VERBS)
def test_a_verb_of_eight_robots_at_once_is_that_of_each(name):
    f, theta, *_ = verb(name)
    many = theta * jnp.linspace(0.8, 1.2, 8)[:, None]
    np.testing.assert_allclose(jax.vmap(f)(many), [float(f(one)) for one in many], rtol=1e-9)


def test_states_at_the_start_are_differentiated_in_a_compiled_program():
    robot = ns.build(parse_robot(PENDULUM))

    def end(q):
        start = State(q, jnp.zeros(1), robot.start.z)
        return ns.simulate(robot, 0.5, samples=3, initial=start, **TIGHT).value.state.q[-1, 0]

    q, h = jnp.array([0.3]), 1e-5
    differences = (float(end(q + h)) - float(end(q - h))) / (2 * h)
    assert float(jax.jit(jax.jacfwd(end))(q)[0]) == pytest.approx(differences, rel=1e-6)


def test_reverse_mode_through_time_steps_gets_the_sentence_of_jax():
    f, theta, *_ = verb("simulate")
    with pytest.raises(ValueError, match="Reverse-mode differentiation does not work"):
        jax.grad(f)(theta)


def test_statuses_come_along_in_a_batch():
    """A pendulum upside down on a spring: stable where the spring is stiff, found all the same where it is soft.

    A batch has the shape under growing loads, of which the other verb takes a side where it is unstable.
    """
    _, build = ns.bind(parse_robot(HELD.replace("axis: y", "axis: y, rest: -90 deg")), ("body.joint.stiffness",))
    found = jax.vmap(lambda theta: ns.static(build(theta)).status)(jnp.array([[30.0], [2.0]]))
    each = [int(ns.static(build(jnp.array([k])), branch="first").status) for k in (30.0, 2.0)]
    assert found.tolist() == each == [Status.SOLVED, Status.UNSTABLE]


def test_what_is_known_of_no_robot_inside_jit_gets_a_sentence():
    robot = ns.build(parse_robot(BALL))
    with pytest.raises(InputError, match=r"inside jax\.jit.* build\(theta\) of theta, build = ns\.bind"):
        jax.jit(lambda robot: ns.steady(robot).speed)(robot)
    assert float(jax.vmap(lambda robot: ns.steady(robot).speed)(jax.tree.map(lambda x: x[None], robot))[0]) > 0


def test_a_quantity_that_is_zero_is_bound():
    """Its tracer is no structure; a robot of its value has a description."""
    theta, build = ns.bind(parse_robot(PENDULUM), ("body.joint.position", "body.mass"))
    assert theta[0] == 0
    assert build(theta).description == parse_robot(PENDULUM)
    assert float(jax.jacfwd(lambda theta: build(theta).start.q[0])(theta)[0]) == 1.0

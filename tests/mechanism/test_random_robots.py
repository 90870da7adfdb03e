"""Properties of the equations of motion, held against random robots: all joints, loads, pairs, in any combination.

In any state: powers go where energy goes, forces where momentum goes, implicit equations are the explicit ones,
derivatives are differences, and a robot set elsewhere, its water with it, moves the same.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jaxtyping import Array
from tests.random_robots import JOINTS, LEAST, LOADS, MOST, PAIRS, elsewhere, freedoms, random_robot

from nectosome.core import State, Status
from nectosome.mechanism import Diagnosis, Robot, diagnose
from nectosome.mechanism.diagnose import energies
from nectosome.model import build
from nectosome.solve import simulate

T = jnp.asarray(0.3)
QUICK, EVERY = (9, 12), 30
each_robot = pytest.mark.parametrize(
    "number", [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in range(EVERY)]
)


class Forces(NamedTuple):
    """Of both forms of the equations: M and h, and the residual of the implicit one at accelerations b."""

    mass: Array
    bias: Array
    residual: Array


def forces(robot: Robot, x: State, b: Array) -> Forces:
    return Forces(*robot.mass_bias(T, x), robot.residual(T, x, b))


forces_of = eqx.filter_jit(forces)
diagnosed = jax.jit(lambda robot, x: (diagnose(robot, T, x), robot.state_rates(T, x)))


@eqx.filter_jit
def slopes_of(robot: Robot, x: State, b: Array, along: tuple[Any, State]) -> Array:
    """Derivatives of the residual along a direction of all numbers of the robot and of the state."""
    arrays, static = eqx.partition(robot, eqx.is_inexact_array)

    def of(arrays: Any, x: State) -> Array:
        return eqx.combine(arrays, static).residual(T, x, b)

    return jax.jvp(of, (arrays, x), along)[1]


@eqx.filter_jit
def energy_after(robot: Robot, x: State, a: Array, z: Any, s: Array) -> Array:
    """Energy [J] a time s later, on a path with velocities v, accelerations a and rates z of the loads' states."""
    states = jax.tree.map(lambda x, rate: x + s * rate, x.z, z)
    return energies(robot, T + s, State(robot.advance(x.q, x.v, s), x.v + s * a, states)).sum()


def slope_at_zero(of: Any) -> Any:
    """Derivative by central differences of two widths, of which Richardson's combination has no second order."""
    h = 2.5e-5  # of stiff tendons the fourth power of 1e-4 s is seen
    ends = [np.asarray(of(jnp.asarray(k * h))) for k in (1, -1, 2, -2)]
    return (8 * (ends[0] - ends[1]) - (ends[2] - ends[3])) / (12 * h)


def states(robot: Robot, seed: int) -> tuple[State, Array, tuple[Any, State]]:
    """A state, accelerations, and a direction of all numbers and of states, at random."""
    rng = np.random.default_rng(seed)
    x = robot.initial()

    def normal(like: Array, size: float) -> Array:
        return jnp.asarray(size * rng.normal(size=like.shape))

    numbers = jax.tree.map(lambda leaf: 0.1 * leaf * normal(leaf, 1.0), eqx.filter(robot, eqx.is_inexact_array))
    along = State(normal(x.q, 0.1), normal(x.v, 0.1), jax.tree.map(jnp.zeros_like, x.z))
    return State(x.q + normal(x.q, 0.1), normal(x.v, 0.5), x.z), normal(x.v, 1.0), (numbers, along)


def moved(robot: Robot, x: State, along: tuple[Any, State], s: Array) -> tuple[Robot, State]:
    arrays, state = jax.tree.map(lambda x, way: x + s * way, (eqx.filter(robot, eqx.is_inexact_array), x), along)
    return eqx.combine(arrays, robot), state


def off_by(robot: Robot, other: Robot, seed: int) -> dict[str, float]:
    """By how much each property is missed at a random state, relative to the largest of its terms."""
    x, b, along = states(robot, seed)
    found: tuple[Diagnosis, Any] = diagnosed(robot, x)
    d, a = found[0], found[0].a
    here, there = forces_of(robot, x, b), forces_of(other, x, b)
    terms = float(jnp.max(jnp.abs(here.mass) @ jnp.abs(b) + jnp.abs(here.bias)))
    solved = forces_of(robot, x, a).residual
    powers = np.concatenate([d.load_power.ravel(), d.reaction_power])
    watts = np.abs(powers).sum()
    # the rate of the energy is v M a + ...: where terms cancel, their rounding is left
    rounding = 10 * np.finfo(float).eps * np.abs(x.v) @ (np.abs(here.mass) @ np.abs(a) + np.abs(here.bias))
    pushes = np.linalg.norm(np.concatenate([d.load_force.sum(axis=1), d.momentum_rate]), axis=-1).sum()
    slope = slopes_of(robot, x, b, along)
    difference = slope_at_zero(lambda s: forces_of(*moved(robot, x, along, s), b).residual)
    rate = slope_at_zero(lambda s: energy_after(robot, x, a, found[1], s))
    off = {
        "explicit solves implicit": np.abs(solved).max() / np.max(np.abs(here.mass) @ np.abs(a) + np.abs(here.bias)),
        "implicit is M b + h": np.abs(here.residual - here.mass @ b - here.bias).max() / terms,
        "M is symmetric": np.abs(here.mass - here.mass.T).max() / np.abs(here.mass).max(),
        "power": max(abs(d.energy_rate - powers.sum()) - rounding, 0.0) / watts,
        "momentum": np.abs(d.momentum_balance).max(initial=0.0) / pushes,
        "elsewhere": np.abs(here.residual - there.residual).max() / terms,
        "energy by differences": abs(d.energy_rate - rate) / watts,
        "slope by differences": np.abs(slope - difference).max() / np.abs(slope).max(),
    }
    return {name: float(value) for name, value in off.items()}


def limit(name: str) -> float:
    return 1e-6 if name.endswith("by differences") else 1e-10


@each_robot
def test_balances_and_derivatives_of_a_random_robot(number: int):
    description = random_robot(number)
    assert LEAST <= freedoms(description) <= MOST
    robot, other = build(description), build(elsewhere(description))
    assert robot.tree.free_v.size == freedoms(description)
    for seed in range(2):
        off = off_by(robot, other, seed)
        assert {name: value for name, value in off.items() if not value < limit(name)} == {}


@pytest.mark.slow
def test_implicit_and_explicit_steps_take_a_random_robot_to_one_place():
    """Both at a tolerance of 1e-8 a step, for a few steps."""
    robot = build(random_robot(2))
    ends = [
        simulate(robot, 0.02, samples=3, method=method, rtol=1e-8, atol=1e-10, initial=robot.initial())
        for method in ("explicit", "implicit")
    ]
    assert [int(run.status) for run in ends] == [Status.SOLVED] * 2
    (explicit, implicit) = (run.value.state for run in ends)
    assert float(jnp.abs(explicit.v).max()) > 0.01
    np.testing.assert_allclose(implicit.q, explicit.q, atol=1e-7)
    np.testing.assert_allclose(implicit.v, explicit.v, atol=1e-6 * float(jnp.abs(explicit.v).max()))


def test_random_robots_have_every_kind_there_is():
    """All loads, joints and pairs of robot files, among the robots of this file."""
    drawn = [random_robot(number) for number in range(EVERY)]
    parts = [part for description in drawn for part in description.parts.values()]
    assert {load.kind for part in parts for load in part.loads.values()} == {*LOADS}
    assert {part.joint.kind for part in parts} | {"fixed"} == {*JOINTS}
    assert {pair.kind for description in drawn for pair in description.pairs.values()} == {*PAIRS}
    assert any(description.tendons for description in drawn)

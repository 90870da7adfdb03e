r"""Readings of a robot at rest, row by row of what was set, and their exact derivatives.

Of the equilibrium $r(q, \theta) = 0$ that `static` finds, by the implicit function theorem:

$$ \frac{dy}{d\theta} = \frac{\partial y}{\partial \theta} - \frac{\partial y}{\partial q} K^{-1}
   \frac{\partial r}{\partial \theta}, \qquad K = \frac{\partial r}{\partial q} $$
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import Solution, State, Status
from nectosome.core.programs.remember import remembered
from nectosome.mechanism import Robot
from nectosome.model.build import Template, instantiate
from nectosome.solve.branches import leaves_first, settle
from nectosome.solve.equilibrium import changed, no_change, solvable, unbalanced
from nectosome.solve.readings import Reading, values_of
from nectosome.solve.small_motions import SmallMotion, Stability, linearised
from nectosome.solve.static import frozen_drives, own_shape


class RestingRobot(eqx.Module):
    """What a robot is besides its numbers, and what of it is compared."""

    template: Template
    readings: tuple[Reading, ...]
    signs: Float[Array, "k"]

    def made(self, numbers: Float[Array, "n"]) -> Robot:
        """The robot with its drives as at t = 0."""
        return frozen_drives(instantiate(self.template, numbers))

    def shape(
        self, numbers: Float[Array, "n"], x: State, directions: Float[Array, "p n"]
    ) -> tuple[Float[Array, "k"], Float[Array, "p k"]]:
        """Readings of one row in a shape, and their derivatives along directions of the numbers."""
        p, n, none = len(directions), x.v.size, no_change(x)

        def at(numbers: Array, y: Array) -> tuple[Array, Array]:
            """Unbalanced forces and readings, displaced by y."""
            robot = self.made(numbers)
            moved = changed(robot, x, y)
            return unbalanced(robot, moved), self.signs * values_of(self.readings, robot, jnp.zeros(()), moved)

        (r, y), change = jax.linearize(at, numbers, none)
        still = jnp.zeros((p, none.size)), jnp.zeros((none.size, numbers.size))
        dr, dy = jax.vmap(change)(
            jnp.concatenate([directions, still[1]]), jnp.concatenate([still[0], jnp.eye(none.size)])
        )
        K, _, free = solvable(dr[p:].T, r, n)
        moved = -jnp.linalg.solve(K, jnp.where(free, 0.0, dr[:p]).T).T
        return y, dy[:p] + moved @ dy[p : p + r.size]


class Rests(NamedTuple):
    """Shapes of all rows at rest."""

    state: State  # leaves [m, ...]
    status: Int[np.ndarray, "m"]  # a `core.Status`
    stability: list[Stability]


def rests(robot: RestingRobot, numbers: Float[Array, "m n"], size: int) -> Rests:
    """Shapes of the rows as `static` finds them, without a branch, of the first `size` of which others are copies.

    A row without an equilibrium has the shape under the last load that had one.
    """
    first = remembered(first_shapes, robot, numbers)
    stability = _stability(robot, numbers, first.value, size)
    state, status, load = jax.tree.map(np.asarray, (first.value, first.status, first.stats["load"]))
    solved = status[:size] == Status.SOLVED
    leave = np.array([leaves_first(robot.template.plan.description, one) for one in stability]) & solved
    leave |= ~solved & (load[:size] == 0)
    if not leave.any():
        return Rests(state, status, stability)
    there = remembered(settled_shapes, robot, numbers)
    beside = _stability(robot, numbers, there.value, size)
    leave &= (np.asarray(there.status)[:size] == Status.SOLVED) & [one.stable for one in beside]
    each = np.pad(leave, (0, len(numbers) - size), mode="edge")

    def chosen(a: np.ndarray, b: Array) -> np.ndarray:
        return np.where(each.reshape(-1, *[1] * (a.ndim - 1)), b, a)

    stability = [b if left else a for a, b, left in zip(stability, beside, leave, strict=True)]
    return Rests(jax.tree.map(chosen, state, there.value), np.where(each, int(Status.SOLVED), status), stability)


def _stability(robot: RestingRobot, numbers: Array, x: State, size: int) -> list[Stability]:
    found = jax.tree.map(np.asarray, remembered(motions, robot, numbers, x))
    return [jax.tree.map(lambda x, k=k: x[k], found).stability for k in range(size)]


def first_shapes(robot: RestingRobot, numbers: Float[Array, "m n"]) -> Solution:
    """First shapes of all rows, by `own_shape`, leaves [m, ...]."""
    return jax.vmap(lambda row: own_shape(robot.made(row)))(numbers)


def settled_shapes(robot: RestingRobot, numbers: Float[Array, "m n"]) -> Solution:
    """Shapes into which the rows fall from their start, leaves [m, ...]."""

    def one(row: Array) -> Solution:
        made = robot.made(row)
        return settle(made, made.initial())

    return jax.vmap(one)(numbers)


def shapes(
    robot: RestingRobot, numbers: Float[Array, "m n"], x: State, directions: Float[Array, "p n"]
) -> tuple[Float[Array, "k m"], Float[Array, "p k m"]]:
    """Readings of all rows in their shapes, and their derivatives along directions of the numbers."""
    y, dy = jax.vmap(robot.shape, in_axes=(0, 0, None))(numbers, x, directions)
    return y.T, jnp.moveaxis(dy, 0, -1)


def motions(robot: RestingRobot, numbers: Float[Array, "m n"], x: State) -> SmallMotion:
    """About the shapes of all rows, leaves [m, ...]."""
    return jax.vmap(lambda row, x: linearised(robot.made(row), x))(numbers, x)

r"""Readings of a robot at rest, row by row of what was set, and their exact derivatives.

Of the equilibrium $r(q, \theta) = 0$ that `load_stepping` finds, by the implicit function theorem:

$$ \frac{dy}{d\theta} = \frac{\partial y}{\partial \theta} - \frac{\partial y}{\partial q} K^{-1}
   \frac{\partial r}{\partial \theta}, \qquad K = \frac{\partial r}{\partial q} $$
"""

from typing import NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.mechanism import Robot
from nectosome.model.build import Template, instantiate
from nectosome.solve.readings import Reading, values_of
from nectosome.solve.small_motions import SmallMotion, linearised
from nectosome.solve.static import changed, frozen_drives, load_stepping, no_change, solvable, unbalanced


class Shapes(NamedTuple):
    """What is read of a robot at rest, in each row."""

    readings: Float[Array, "k m"]
    derivatives: Float[Array, "p k m"]  # along each direction
    status: Int[Array, "m"]  # a `core.Status`


class RestingRobot(eqx.Module):
    """What a robot is besides its numbers, and what of it is compared."""

    template: Template
    readings: tuple[Reading, ...]
    signs: Float[Array, "k"]

    def made(self, numbers: Float[Array, "n"]) -> Robot:
        """The robot with its drives as at t = 0."""
        return frozen_drives(instantiate(self.template, numbers))

    def shape(
        self, numbers: Float[Array, "n"], directions: Float[Array, "p n"]
    ) -> tuple[Float[Array, "k"], Float[Array, "p k"], Int[Array, ""]]:
        """Readings of one row, their derivatives along directions of the numbers, and status."""
        x, status = (found := load_stepping(self.made(numbers))).value, found.status
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
        return y, dy[:p] + moved @ dy[p : p + r.size], status

    def motion(self, numbers: Float[Array, "n"]) -> SmallMotion:
        """About the shape of one row."""
        robot = self.made(numbers)
        return linearised(robot, load_stepping(robot).value)


def shapes(robot: RestingRobot, numbers: Float[Array, "m n"], directions: Float[Array, "p n"]) -> Shapes:
    """Shapes of all rows at once; a row without an equilibrium has the readings of the last load that had one."""
    y, dy, status = jax.vmap(robot.shape, in_axes=(0, None))(numbers, directions)
    return Shapes(y.T, jnp.moveaxis(dy, 0, -1), status)


def motions(robot: RestingRobot, numbers: Float[Array, "m n"]) -> SmallMotion:
    """About the shapes of all rows, leaves [m, ...]."""
    return jax.vmap(robot.motion)(numbers)

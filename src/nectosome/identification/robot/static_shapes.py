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

from nectosome.core import State
from nectosome.mechanism import Robot
from nectosome.model.build import Template, instantiate
from nectosome.solve.readings import Reading, values_of
from nectosome.solve.small_motions import SmallMotion, linearised
from nectosome.solve.static import frozen_drives, load_stepping


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
        t, found = jnp.zeros(()), load_stepping(self.made(numbers))
        q, still, p = found.value.q, jnp.zeros_like(found.value.v), len(directions)

        def at(numbers: Array, w: Array) -> tuple[Array, Array]:
            """Unbalanced forces and readings, displaced by w."""
            robot = self.made(numbers)
            x = State(robot.advance(q, w, jnp.ones(())), still, robot.initial().z)
            return robot.residual(t, x, still), self.signs * values_of(self.readings, robot, t, x)

        (_, y), change = jax.linearize(at, numbers, still)
        none = jnp.zeros((p, still.size)), jnp.zeros((still.size, numbers.size))
        r, dy = jax.vmap(change)(
            jnp.concatenate([directions, none[1]]), jnp.concatenate([none[0], jnp.eye(still.size)])
        )
        moved = -jnp.linalg.solve(r[p:].T, r[:p].T).T
        return y, dy[:p] + moved @ dy[p:], found.status

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

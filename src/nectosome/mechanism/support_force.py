"""Force of a robot on its support, as a load cell measures it."""

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import State
from nectosome.core.se3 import dot

from .diagnose import diagnose
from .robot import Robot, times


def support_force(robot: Robot, t: Float[Array, ""], x: State) -> Float[Array, "3"]:
    """Force on the support of the robot, world frame [N]: the sum of all loads minus the rate of its momentum."""

    def momentum(t: Array, x: State) -> Array:
        q, v, _ = robot.tree.complete(t, x.q, x.v)
        shape = robot.tree.shape(q)
        return jnp.sum(dot(shape.rotation, times(robot.inertia, robot.tree.twists(shape, v))[:, 3:]), axis=0)

    rate = jax.jvp(momentum, (t, x), (jnp.ones(()), robot.rates(t, x)))[1]
    return jnp.sum(diagnose(robot, t, x).load_force, axis=(0, 1)) - rate

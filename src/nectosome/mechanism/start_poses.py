"""Poses of a robot's stations at the start."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from .robot import Robot


def start_poses(robot: Robot) -> tuple[Float[Array, "n 3 3"], Float[Array, "n 3"]]:
    """Rotations and positions [m] of all stations at t = 0, station frame to world frame."""
    x = robot.initial()
    q, _, _ = robot.tree.complete(jnp.zeros(()), x.q, x.v)
    shape = robot.tree.shape(q)
    return shape.rotation, shape.position

"""Weight and buoyancy, also of partly submerged bodies."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, uplift, wetted
from nectosome.core.se3 import dot_t


class Weight(Load):
    """Gravity on the body's own mass: m g at the centre of mass."""

    by_station = mild = True

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench of gravity: inertia times the acceleration g."""
        up = strips.rotation[:, None, 2, :]
        return -water.gravity * jnp.sum(strips.inertia[:, :, 3:] * up, axis=-1), z


class Buoyancy(Load):
    """Archimedes: -rho V g at the centre of the displaced water, and rho V Dc/Dt of an accelerating current."""

    by_station = mild = True

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on each station: without a moment under water, by the shape of what is under the surface at it."""
        none = jnp.zeros_like(strips.velocity)
        if water.surface is None:
            up = jnp.concatenate([none, strips.rotation[:, 2, :]], axis=-1)
        else:
            up = uplift(strips, water.surface)
        push = water.gravity * up
        if water.current is not None:
            rate = dot_t(strips.rotation, water.flow(t, strips.position)[1])
            push += jnp.concatenate([none, wetted(strips, water)[:, None] * rate], axis=-1)
        return (water.density * strips.volume)[:, None] * push, z

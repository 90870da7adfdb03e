"""Weight and buoyancy, also of bodies that stand partly out of the water."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water
from nectosome.core.se3 import dot_t


def wetted(strips: Strips, water: Water) -> Float[Array, "n"]:
    r"""Share of each station's section under water, 1 in deep water.

    The part of a disc below a level at height d (in half heights) above its centre,
    $\tfrac12 + (d\sqrt{1-d^2} + \arcsin d)/\pi$; the half height H of a tilted strip is
    $\sqrt{(r_y R_{zy})^2 + (r_z R_{zz})^2} + \tfrac12 w |R_{zx}|$. Exact for a level round rod and for a sum of
    upright strips.
    """
    if water.surface is None:
        return jnp.ones_like(strips.weight)
    up = strips.rotation[:, 2, :]
    across = (strips.half_width[:, 0] * up[:, 1]) ** 2 + (strips.half_width[:, 1] * up[:, 2]) ** 2
    half_height = jnp.sqrt(across + 1e-300) + 0.5 * strips.weight * jnp.abs(up[:, 0])
    d = (water.surface - strips.position[:, 2]) / half_height
    inside = jnp.abs(d) < 1
    e = jnp.where(inside, d, 0.0)
    return jnp.where(inside, 0.5 + (e * jnp.sqrt(1 - e * e) + jnp.arcsin(e)) / jnp.pi, jnp.where(d > 0, 1.0, 0.0))


def _downward(strips: Strips) -> Float[Array, "n 3"]:
    """The direction -z of the world in each station's frame."""
    return dot_t(strips.rotation, jnp.array([0.0, 0.0, -1.0]))


class Weight(Load):
    """Gravity on the body's own matter: m g at the centre of mass."""

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench of gravity, inertia times the acceleration g."""
        g = water.gravity * _downward(strips)
        return jnp.einsum("nij,nj->ni", strips.inertia[:, :, 3:], g), z


class Buoyancy(Load):
    """Archimedes: -rho V g at the centre of the displaced water, and rho V Dc/Dt of an accelerating current."""

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Force on each station; no moment, since stations sit on the axis."""
        displaced = water.density * strips.volume * wetted(strips, water)
        push = -water.gravity * _downward(strips)
        if water.current is not None:
            push = push + dot_t(strips.rotation, water.flow(t, strips.position)[1])
        f = displaced[:, None] * push
        return jnp.concatenate([jnp.zeros_like(f), f], axis=-1), z

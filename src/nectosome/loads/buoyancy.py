"""Weight and buoyancy, also of partly submerged bodies."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water
from nectosome.core.se3 import dot_t


def wetted(strips: Strips, water: Water) -> Float[Array, "n"]:
    r"""Submerged fraction of each station's volume, 1 in deep water.

    A disc with its centre d half heights under the surface has the submerged fraction $F(d) = \tfrac12 + (d\sqrt{1-d^2}
    + \arcsin d)/\pi$, a strip the mean of F between its ends. The half height of a tilted section is
    $\sqrt{(r_y R_{zy})^2 + (r_z R_{zz})^2}$. Exact for level and for upright bodies.
    """
    if water.surface is None:
        return jnp.ones_like(strips.weight)
    up = strips.rotation[:, 2, :]
    across = (strips.half_width[:, 0] * up[:, 1]) ** 2 + (strips.half_width[:, 1] * up[:, 2]) ** 2
    half_height = jnp.sqrt(across + _THIN**2)
    centre = strips.ends.T * up[:, 0] + strips.position[:, 2]
    d = (water.surface - centre) / half_height
    span = d[1] - d[0]
    level = jnp.abs(span) < 1e-4
    mean = (_wet_integral(d[1]) - _wet_integral(d[0])) / jnp.where(level, 1.0, span)
    return jnp.where(level, _wet_disc(0.5 * (d[0] + d[1])), mean)


_THIN = 1e-9  # [m] least half height, for upright bodies


def _wet_disc(d: Float[Array, "n"]) -> Float[Array, "n"]:
    """Submerged fraction F(d) of a disc with its centre d half heights under the surface."""
    inside = jnp.abs(d) < 1
    e = jnp.where(inside, d, 0.0)
    return jnp.where(inside, 0.5 + (e * jnp.sqrt(1 - e * e) + jnp.arcsin(e)) / jnp.pi, jnp.where(d > 0, 1.0, 0.0))


def _wet_integral(d: Float[Array, "n"]) -> Float[Array, "n"]:
    """Integral of F from -infinity to d."""
    inside = jnp.abs(d) < 1
    e = jnp.where(inside, d, 0.0)
    root = jnp.sqrt(1 - e * e)
    within = 0.5 * e + (e * jnp.arcsin(e) + root - root**3 / 3) / jnp.pi
    return jnp.where(inside, within, jnp.where(d > 0, d, 0.0))


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
        """Force on each station; no moment, since stations are on the axis."""
        displaced = water.density * strips.volume * wetted(strips, water)
        push = water.gravity * strips.rotation[:, 2, :]
        if water.current is not None:
            push += dot_t(strips.rotation, water.flow(t, strips.position)[1])
        return jnp.concatenate([jnp.zeros_like(push), displaced[:, None] * push], axis=-1), z

"""Weight and buoyancy, also of partly submerged bodies."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, uplift, wetted
from nectosome.core.se3 import dot_t

from .hydrostatics import raised


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


class MeshBuoyancy(Buoyancy):
    r"""The same of a body of triangles under a surface: of the polyhedron, exactly.

    With E(d, u) of `hydrostatics` about the part's first station, V = dE/dd under water and its first moment
    $m = -\partial E / \partial u$, the force is $\rho V a$ and the moment $\rho m \times a$ for the acceleration
    a = g u + Dc/Dt, taken at the first station: at rest they are minus the gradient of the energy $\rho g E$.
    """

    corners: Float[Array, "m 3 3"]  # of each triangle [m], about the first station in its frame
    share: Float[Array, ""]  # of the displaced volume in that of the triangles, as where the part is flooded

    by_station = False
    on_first = True

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the first station."""
        up = strips.rotation[0, 2]
        if water.surface is None:  # as deep as holds all of it
            depth = 2 * jnp.sqrt(jnp.max(jnp.sum(self.corners**2, axis=-1)))
        else:
            depth = water.surface - strips.position[0, 2]
        volume, slope = jax.grad(raised, argnums=(1, 2))(self.corners, depth, up)
        acceleration = water.gravity * up
        if water.current is not None:
            acceleration += dot_t(strips.rotation, water.flow(t, strips.position)[1])[0]
        push = jnp.concatenate([jnp.cross(acceleration, slope), volume * acceleration])
        return strips.at_first(water.density * self.share * push), z

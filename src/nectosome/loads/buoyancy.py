"""Weight and buoyancy, also of partly submerged bodies."""

from typing import Any

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, displaced
from nectosome.core.se3 import cross, dot_t


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
        push = water.gravity * strips.rotation[:, 2, :]
        if water.current is not None:
            push += dot_t(strips.rotation, water.flow(t, strips.position)[1])
        if water.surface is None:
            wrench = jnp.concatenate([jnp.zeros_like(push), push], axis=-1)
        else:
            share, slope = displaced(t, strips, water)
            wrench = jnp.concatenate([cross(push, slope), share[:, None] * push], axis=-1)
        return (water.density * strips.volume)[:, None] * wrench, z


class MeshBuoyancy(Buoyancy):
    r"""The same of a body of triangles under a surface: of the polyhedron, exactly.

    With E(d, u) of `raised` about the part's first station, V = dE/dd under water and its first moment
    $m = -\partial E / \partial u$, the force is $\rho V a$ and the moment $\rho m \times a$ for the acceleration
    a of g upwards and Dc/Dt, taken at the first station: at rest they are minus the gradient of the energy $\rho g E$.
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
            place, normal = water.plane(t, strips.position[:1])
            depth, up = place[0], dot_t(strips.rotation[0], normal[0])
        volume, slope = jax.grad(raised, argnums=(1, 2))(self.corners, depth, up)
        acceleration = water.gravity * strips.rotation[0, 2]
        if water.current is not None:
            acceleration += dot_t(strips.rotation, water.flow(t, strips.position)[1])[0]
        push = jnp.concatenate([jnp.cross(acceleration, slope), volume * acceleration])
        return strips.at_first(water.density * self.share * push), z


def raised(corners: Float[Array, "m 3 3"], depth: Float[Array, ""], up: Float[Array, "3"]) -> Float[Array, ""]:
    r"""Integral E [m4] of the depth over the volume of a closed surface under the water's flat surface, exactly.

    In the body's own axes let u be the vector upwards and d the depth [m] of its origin: a point x is at the depth
    $s = d - u \cdot x$. The three corners [m] of each triangle run counter-clockwise as seen from outside. Then

    $$ E(d, u) = \int_{s > 0} s\, dV = -\frac{1}{2 |u|^2} \sum_T (u \cdot n_T)\, A_T\, \overline{s_+^2} $$

    by Gauss's theorem: a sum over the triangles (normal n, area A) with the mean of $s_+^2$ on each, which vanishes on
    the water's surface. $\rho g E$ is the energy of the water that the body has raised to the surface. The rest of
    hydrostatics are derivatives, with the volume V under water and the waterplane's area $A_w$:

    $$ \frac{\partial E}{\partial d} = V, \quad \frac{\partial E}{\partial u} = -\int x\, dV, \quad
       \frac{\partial^2 E}{\partial d^2} = A_w, \quad
       \frac{\partial^2 E}{\partial d\, \partial u} = -\int x\, dA_w, \quad
       \frac{\partial^2 E}{\partial u^2} = \int x x^T dA_w $$
    """
    a, b, c = (corners[:, k] for k in range(3))
    doubled = jnp.cross(b - a, c - a) @ up
    return -0.25 * jnp.sum(doubled * _mean_square(depth - corners @ up)) / (up @ up)


def _mean_square(depths: Float[Array, "m 3"]) -> Float[Array, "m"]:
    r"""Mean of $s_+^2$ over each triangle, s linear between its corners.

    It is $p^4 / (6 (p - q)(p - r))$ where only the corner p is under water, $(\sum_i s_i^2 + \sum_{i<j} s_i s_j)/6$
    where all are, and the second less the first where only the corner p is dry.
    """
    low, middle, high = _sorted(*jnp.moveaxis(depths, 1, 0))
    wet_corner, dry_corner = (high > 0) & (middle <= 0), (low < 0) & (middle > 0)
    p = jnp.where(wet_corner, high, jnp.where(dry_corner, low, 1.0))  # 1 and 0 where there is none
    q, r = jnp.where(wet_corner | dry_corner, middle, 0.0), jnp.where(wet_corner, low, jnp.where(dry_corner, high, 0.0))
    corner = p**4 / ((p - q) * (p - r))
    whole = low * (low + middle + high) + middle * (middle + high) + high**2
    return jnp.where(wet_corner, corner, jnp.where(high > 0, whole - jnp.where(dry_corner, corner, 0.0), 0.0)) / 6


def _sorted(a: Array, b: Array, c: Array) -> tuple[Array, Array, Array]:
    """Three rows in order. Derivatives take one side of a tie: those of minima and maxima would take half of each."""
    a, b = jnp.where(b < a, b, a), jnp.where(b < a, a, b)
    b, c = jnp.where(c < b, c, b), jnp.where(c < b, b, c)
    a, b = jnp.where(b < a, b, a), jnp.where(b < a, a, b)
    return a, b, c

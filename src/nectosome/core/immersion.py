r"""What of a body is under the water's surface, in closed form: the share of its volume, and its middle.

A shape is a box, a cylinder of elliptic section or an ellipsoid about a station: a whole rigid part, or a strip. A
point x from its middle is at the depth $\delta = d - x \cdot u$, with the depth d of the middle and the vertical u in
the shape's own axes. The mean of $\max(0, \delta)$ over its volume is

$$ E(d, u), \quad \partial E / \partial d = w, \quad U = \rho g V E $$

with the share w under water and the potential energy U of the displaced water, raised to the surface. Force and moment
about the station are the gradient of U in its pose, $\rho g V\, w\, u$ and $\rho g V\, u \times \partial E / \partial
u$: Archimedes' force at the centre of the displaced water, which takes no energy on any closed path.

By one axis of half length a the depths are spread evenly over $\pm p$, $p = a u_x$; by an elliptic section as a
semicircle over $\pm s$, $s^2 = (r_y u_y)^2 + (r_z u_z)^2$; by an ellipsoid as a parabola. E is the ramp max(0, d)
averaged over these, one after the other.

In waves the surface is the plane that touches it over the station, u its normal and d the depth along that: waves are
long against a shape.
"""

from collections.abc import Callable

import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_derivatives import custom_jvp
from jaxtyping import Array, Float

from .se3 import cross, dot, dot_t
from .system import Strips
from .water import Water

_THIN = 1e-9  # least depth of a shape along each of its axes, of its half length there
_SHORT = 0.05  # half depth of a cylinder's axis over that of its section, below which quadrature takes the place
_GAUSS = np.polynomial.legendre.leggauss(5)


def wetted(t: Float[Array, ""], strips: Strips, water: Water) -> Float[Array, "n"]:
    """Share of each station's volume under water, 1 in deep water: of its strip, at a rigid part's centre of all."""
    return jnp.ones_like(strips.weight) if water.surface is None else _share(strips, *_place(t, strips, water))


def wetting(
    t: Float[Array, ""], strips: Strips, twist: Float[Array, "n 6"], water: Water
) -> tuple[Float[Array, "n"], Float[Array, "n"]]:
    """Share under water and its rate [1/s] for body twists of the stations in the world, with waves that pass."""
    place = _place(t, strips, water)
    up = place[1]
    rise, turning = -jnp.sum(up * twist[:, 3:], axis=1), cross(up, twist[:, :3])
    if water.waves:
        goes = jnp.ones_like(t), dot(strips.rotation, twist[:, 3:])
        _, (rise, tilt) = jax.jvp(water.plane, (t, strips.position), goes)
        turning = turning + dot_t(strips.rotation, tilt)
    return jax.jvp(lambda depth, up: _share(strips, depth, up), place, (rise, turning))


def displaced(t: Float[Array, ""], strips: Strips, water: Water) -> tuple[Float[Array, "n"], Float[Array, "n 3"]]:
    """Share of each station's volume under the surface, and minus the first moment [m] of that about the station.

    They are the gradient of E in depth and vertical. With an acceleration a of the water in the station's frame, that
    of gravity included, the displaced water pushes by its share times a, with the moment a x (this gradient).
    """
    return jax.grad(lambda depth, up: jnp.sum(_mean_depth(strips, depth, up)), argnums=(0, 1))(
        *_place(t, strips, water)
    )


def _place(t: Array, strips: Strips, water: Water) -> tuple[Float[Array, "n"], Float[Array, "n 3"]]:
    """Depth of each station under the plane of the surface next to it, and the normal of that in its own frame."""
    assert water.surface is not None
    if not water.waves:
        return water.surface - strips.position[:, 2], strips.rotation[:, 2, :]
    depth, normal = water.plane(t, strips.position)
    return depth, dot_t(strips.rotation, normal)


def reach_up(strips: Strips) -> Float[Array, "n"]:
    """How high the shape of each station reaches over it [m]."""
    along, across = _depths(strips, strips.rotation[:, 2, :])
    section = jnp.sqrt(jnp.sum(across**2, axis=1))
    box, ball = along + jnp.sum(across, axis=1), jnp.sqrt(along**2 + section**2)
    return _by_shape(strips, box, along + section, ball)


def _share(strips: Strips, depth: Float[Array, "n"], up: Float[Array, "n 3"]) -> Float[Array, "n"]:
    return jax.grad(lambda depth: jnp.sum(_mean_depth(strips, depth, up)))(depth)


def _mean_depth(strips: Strips, depth: Float[Array, "n"], up: Float[Array, "n 3"]) -> Float[Array, "n"]:
    """Mean E of max(0, depth) [m] over the shape of each station, which is at this depth itself."""
    along, across = _depths(strips, up)
    section = jnp.sqrt(jnp.sum(across**2, axis=1))
    return _by_shape(
        strips,
        _of_box(depth, along, across[:, 0], across[:, 1]),
        _of_cylinder(depth, along, section),
        _of_ball(depth, jnp.sqrt(along**2 + section**2)),
    )


def _by_shape(strips: Strips, box: Array, cylinder: Array, ball: Array) -> Array:
    return jnp.where(strips.round_axes < 1, box, jnp.where(strips.round_axes < 2.5, cylinder, ball))


def _depths(strips: Strips, up: Array) -> tuple[Float[Array, "n"], Float[Array, "n 2"]]:
    """Half depths of each shape along and across its axis [m]."""
    half = jnp.concatenate([strips.half_length[:, None], strips.half_width], axis=1)
    depths = half * jnp.sqrt(up**2 + _THIN**2)
    return depths[:, 0], depths[:, 1:]


def _of_box(d: Array, a: Array, b: Array, c: Array) -> Array:
    r"""Mean of max(0, d) over three even spreads: a divided difference, $\Delta_p \Delta_q \Delta_r d_+^4 / 24$.

    $\Delta_p f(d) = (f(d + p) - f(d - p)) / 2p$. With $p \ge q \ge r$ and each piece as it comes no digits are lost,
    however thin the spreads are.
    """
    p, r = jnp.maximum(jnp.maximum(a, b), c), jnp.minimum(jnp.minimum(a, b), c)
    q = jnp.maximum(jnp.minimum(a, b), jnp.minimum(jnp.maximum(a, b), c))

    def once(t: Array) -> Array:
        """Of t^4 over r."""
        cut = jnp.clip(t + r, 0.0, 2 * r)
        return jnp.where(t >= r, 4 * t * (t * t + r * r), 0.5 * cut**4 / jnp.where(r > 0, r, 1.0))

    def twice(t: Array) -> Array:
        """And over q."""
        edge = q + r
        near = jnp.clip(t, -edge, edge)
        within = 0.5 * _difference(once, near, q) / q
        return jnp.where(t >= edge, 12 * t * t + 4 * (q * q + r * r), within)

    return jnp.where(d > p + q + r, d, _difference(twice, d, p) / (48 * p))


def _difference(f: Callable[[Array], Array], middle: Array, half: Array) -> Array:
    """f(middle + half) - f(middle - half), with f traced once."""
    ends = f(jnp.stack([middle + half, middle - half]))
    return ends[0] - ends[1]


def _of_cylinder(d: Array, h: Array, s: Array) -> Array:
    """Mean of max(0, d) over an even spread h and a semicircle s."""
    long = h > _SHORT * s
    wide = jnp.where(long, h, s)
    even = 0.5 * _difference(lambda d: _second(d, s), d, wide) / wide
    place, weight = (x[:, None] for x in _GAUSS)
    level = jnp.sum(0.5 * weight * _first(d + place * h, s), axis=0)
    return jnp.where(d > h + s, d, jnp.where(long, even, level))


def _of_ball(d: Array, s: Array) -> Array:
    """Mean of max(0, d) over a parabola."""
    t = jnp.clip(d / s, -1.0, 1.0)
    return jnp.where(d >= s, d, s * (3 + 8 * t + 6 * t**2 - t**4) / 16)


def _first(d: Array, s: Array) -> Array:
    """Integral over d of the share of an ellipse at the depth d, of half depth s."""
    return jnp.where(d >= s, d, s * _once(jnp.clip(d / s, -1.0, 1.0)))


def _second(d: Array, s: Array) -> Array:
    """The integral of that."""
    return jnp.where(d >= s, 0.5 * d * d + s * s / 8, s * s * _twice(jnp.clip(d / s, -1.0, 1.0)))


@custom_jvp
def _segment(t: Array) -> Array:
    """Share of a disc of radius 1 that is under water with its centre at the depth t, -1 to 1."""
    return 0.5 + (t * _root(t) + jnp.arcsin(t)) / jnp.pi


@custom_jvp
def _once(t: Array) -> Array:
    """Its integral from -1."""
    return 0.5 * t + (t * jnp.arcsin(t) + _root(t) * (2 + t * t) / 3) / jnp.pi


@custom_jvp
def _twice(t: Array) -> Array:
    """The integral of that."""
    return (4 * t * t + 1) * (jnp.arcsin(t) / (8 * jnp.pi) + 1 / 16) + t * _root(t) * (13 + 2 * t * t) / (24 * jnp.pi)


def _root(t: Array) -> Array:
    return jnp.sqrt(jnp.maximum(1 - t * t, 1e-30))


_segment.defjvps(lambda dt, _, t: 2 / jnp.pi * _root(t) * dt)
_once.defjvps(lambda dt, _, t: _segment(t) * dt)
_twice.defjvps(lambda dt, _, t: _once(t) * dt)

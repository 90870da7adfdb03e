"""Flat plates of even thickness by their outlines: areas, moments, and how wide they are across lines."""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float


class OutlineMoments(NamedTuple):
    """Area of an outline, and its moments about the axes through its centre."""

    area: Float[Array, ""]  # [m2]
    centre: Float[Array, "2"]  # [m]
    second: Float[Array, "2 2"]  # integral of r r^T over the area [m4]


def outline_moments(points: Float[Array, "n 2"]) -> OutlineMoments:
    r"""Moments of a polygon, whatever its direction and first corner, by triangles from its first corner.

    $$ A = \tfrac12 \sum_k a \times b, \quad A c = \tfrac16 \sum_k (a \times b)(a + b), \quad
       S = \tfrac1{24} \sum_k (a \times b)\,(a a^T + b b^T + (a + b)(a + b)^T) $$

    with the corners a and b of each edge seen from there (Green's theorem), and S then moved to the centre.
    """
    start = points[0]
    a = points - start
    b = jnp.roll(a, -1, axis=0)
    twice = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
    twice = twice * jnp.sign(jnp.sum(twice))
    area, both = 0.5 * jnp.sum(twice), a + b
    centre = jnp.sum(twice[:, None] * both, axis=0) / (6 * area)
    outer = [x[:, :, None] * x[:, None, :] for x in (a, b, both)]
    second = jnp.sum(twice[:, None, None] * sum(outer), axis=0) / 24
    return OutlineMoments(area, start + centre, second - area * centre[:, None] * centre[None, :])


def outline_range(points: Float[Array, "n 2"]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Smallest and largest of the first coordinates of a polygon [m]."""
    return jnp.min(points[:, 0]), jnp.max(points[:, 0])


def outline_widths(points: Float[Array, "n 2"], at: Float[Array, "k"]) -> tuple[Float[Array, "k"], Float[Array, "k"]]:
    """Widths of a polygon across lines where its first coordinate is `at`, and their middles [m].

    A line that crosses it several times has the sum of the widths, and the middle of all of them.
    """
    a, b = points, jnp.roll(points, -1, axis=0)
    area = jnp.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])
    x = at[:, None]
    rises, falls = (a[:, 0] <= x) & (x < b[:, 0]), (b[:, 0] <= x) & (x < a[:, 0])
    crosses = rises | falls
    run = jnp.where(crosses, b[:, 0] - a[:, 0], 1.0)
    y = a[:, 1] + (x - a[:, 0]) / run * (b[:, 1] - a[:, 1])
    sign = jnp.sign(area) * jnp.where(falls, 1.0, jnp.where(rises, -1.0, 0.0))
    width, moment = jnp.sum(sign * y, axis=1), 0.5 * jnp.sum(sign * y * y, axis=1)
    return width, moment / width


def plate_inertia(
    mass: Float[Array, ""], moments: OutlineMoments, thickness: Float[Array, ""], upright: bool
) -> Float[Array, "3 3"]:
    """Inertia of an even plate about its centre, in the x-y plane, or upright in the x-z plane [kg m2]."""
    (xx, xy), (_, yy) = mass / moments.area * moments.second
    zz = mass * thickness**2 / 12
    if upright:
        return jnp.array([[yy + zz, 0.0, -xy], [0.0, xx + yy, 0.0], [-xy, 0.0, xx + zz]])
    return jnp.array([[yy + zz, -xy, 0.0], [-xy, xx + zz, 0.0], [0.0, 0.0, xx + yy]])

r"""Nearest sphere of a chain of round cones: spheres with a linearly varying radius between nodes.

On a cone with the radius $r + k s$ at the distance s along its axis, a point at the distance x along the axis and y
from the axis is nearest to the sphere at

$$ s = x + y \frac{k}{\sqrt{1 - k^2}} $$

or to that at the nearer end. There the distance $|x - c(s)| - r(s)$ has derivative 0 by s, so its gradient by the point
is the direction from c to the point, also for tapered bodies.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.core.se3 import safe_norm

_STEEPEST = 1 - 1e-9  # for a sphere that contains the next one, the outer end is nearest
_NONE = 1e-30  # [m2] least squared distance of nodes


class Nearest(NamedTuple):
    """For each point the nearest sphere of the chain, at the fraction `share` from node `segment` to the next."""

    segment: Int[Array, "m"]
    share: Float[Array, "m"]
    normal: Float[Array, "m 3"]  # unit vector from the sphere's centre to the point; 0 at the centre
    distance: Float[Array, "m"]  # from the sphere's surface to the point [m], negative inside


def nearest(points: Float[Array, "m 3"], nodes: Float[Array, "n 3"], radius: Float[Array, "n"]) -> Nearest:
    """Nearest spheres of a chain with at least two nodes; of equally near ones, the one nearer to the root."""
    along, wider = nodes[1:] - nodes[:-1], radius[1:] - radius[:-1]
    square = jnp.maximum(jnp.sum(along * along, axis=-1), _NONE)
    length = jnp.sqrt(square)
    slope = jnp.clip(wider / length, -_STEEPEST, _STEEPEST)
    to = points[:, None] - nodes[:-1]
    x = jnp.sum(to * along, axis=-1) / square
    y = safe_norm(to - x[..., None] * along)
    share = jnp.clip(x + y * slope / (length * jnp.sqrt(1 - slope**2)), 0.0, 1.0)
    from_axis = to - share[..., None] * along
    far = safe_norm(from_axis)
    distance = far - radius[:-1] - share * wider
    segment = jnp.argmin(distance, axis=1)
    picked = jnp.arange(points.shape[0]), segment
    far = far[picked][:, None]
    normal = from_axis[picked] / jnp.where(far > 0, far, 1.0)
    return Nearest(segment, share[picked], normal, distance[picked])

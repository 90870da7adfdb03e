r"""The nearest place of a chain of round cones, spheres whose radius changes evenly from node to node.

On a cone with the axis from p, L long, and the radius $r + k s$ at the way s along it, a point at the way x along the
axis and the distance y from it is nearest to the sphere at

$$ s = x + y \frac{k}{\sqrt{1 - k^2}} $$

or to that at the end beyond which this lies. There the distance $|x - c(s)| - r(s)$ has no slope along s, so that its
gradient by the point is the direction from c to the point, with tapered bodies too.
"""

from typing import NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.core.se3 import safe_norm

_STEEPEST = 1 - 1e-9  # where one sphere holds the next, the outer end is nearest
_NONE = 1e-30  # m2: of two nodes in one place


class Nearest(NamedTuple):
    """For each point the nearest sphere of the chain, the share of the way from node `segment` to the next."""

    segment: Int[Array, "m"]
    share: Float[Array, "m"]
    normal: Float[Array, "m 3"]  # from the sphere's centre to the point, one long; 0 at the centre itself
    distance: Float[Array, "m"]  # of the point from the sphere's surface [m], negative inside


def nearest(points: Float[Array, "m 3"], nodes: Float[Array, "n 3"], radius: Float[Array, "n"]) -> Nearest:
    """Nearest places of a chain with at least two nodes; of two as near, that towards the root."""
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

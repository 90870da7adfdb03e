"""Where the parts of a robot are and end, and how long it is ahead."""

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, Int

from nectosome.core import State, safe_norm
from nectosome.core.se3 import dot_t

from .rods import SoftRod
from .tree import PartShape, Tree


def points(
    tree: Tree,
    rotation: Float[Array, "*t n 3 3"],
    position: Float[Array, "*t n 3"],
    ends: Float[Array, "links 2 3"] | None = None,
) -> Float[Array, "*t m 3"]:
    """All stations and then the roots and tips of rigid links, world frame [m], from the poses of the stations.

    Instead of roots and tips there may be other `ends`, on their links.
    """
    links = [i for i, part in enumerate(tree.structure) if part.link]
    if not links:
        return position
    centres = np.array([tree.layout[i].stations.start for i in links])
    own = np.cumsum([0, *(tree.structure[i].stations for i in links)])[:-1]  # the same among the stations of links
    frame = tree.link_stations[own]  # of the centre, from the root
    to_root = -frame[..., 3] if ends is None else ends[:, 0] - frame[..., 3]
    to_tip = (tree.link_tips[..., 3] if ends is None else ends[:, 1]) - frame[..., 3]
    local = jnp.stack([dot_t(frame[..., :3], x) for x in (to_root, to_tip)])  # in the frame of the centre
    turned = jnp.sum(rotation[..., None, centres, :, :] * local[..., None, :], axis=-1)
    ends = position[..., None, centres, :] + turned
    return jnp.concatenate([position, ends.reshape(*ends.shape[:-3], -1, 3)], axis=-2)


def points_of(tree: Tree, part: int) -> Int[np.ndarray, "k"]:
    """Places among all `points` of those of one part."""
    own, links = tree.layout[part].stations, [i for i, each in enumerate(tree.structure) if each.link]
    stations = np.arange(own.start, own.stop)
    if part not in links:
        return stations
    n, k = tree.layout[-1].stations.stop, links.index(part)
    return np.append(stations, [n + k, n + len(links) + k])


def unbent(tree: Tree, x: State) -> PartShape:
    """Poses of all stations at t = 0, with rods as they are without strains."""
    q, *_ = tree.complete(jnp.zeros(()), x.q, x.v)
    bent = np.concatenate([np.zeros(0, int), *(places.ravel() for places in tree.indices.rod_q)])
    return tree.shape(q * np.where(np.isin(np.arange(q.shape[0]), bent), 0.0, 1.0))


def length_ahead(tree: Tree, x: State, shape: PartShape, ahead: Float[np.ndarray, "3"]) -> Float[Array, ""]:
    """Length [m] of a robot at its start x and in its shape there, along a unit vector in the frame of its first part.

    It is the extent of the axes of all parts, and at stations of their sections, taken as ellipses. Rods whose strains
    are prescribed or driven, or do not start at 0, count as unbent; others begin so.
    """
    if tree.strains or tree.strain_starts or any(isinstance(g.things, SoftRod) and g.things.driven for g in tree.rods):
        shape = unbent(tree, x)
    rotation, position = shape.rotation, shape.position
    direction = rotation[0] @ ahead
    across = dot_t(rotation, jnp.broadcast_to(direction, position.shape))[:, 1:]
    reach = safe_norm(across * tree.stations.half_width)
    along = points(tree, rotation, position, tree.link_ends) @ direction
    reach = jnp.concatenate([reach, jnp.zeros(along.shape[0] - reach.shape[0])])
    return jnp.max(along + reach) - jnp.min(along - reach)

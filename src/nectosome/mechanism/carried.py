r"""The water that a robot carries along: its added mass, and what the change of that does.

If a load changes the shape of a body, the momentum A V of the water also changes with its added mass A, which gives the
wrench $-\dot A V$. Where the water has a surface, each station has the added mass w A, by its share w of volume under
water. Water that the body meets is at rest and takes the wrench $-\dot w A V$ for $\dot w > 0$ (von Karman 1929); water
that it leaves keeps its velocity and takes none. Both times $\tfrac12 |\dot w| V \cdot A V$ goes into the water: the
spray, the wake.
"""

from typing import Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Strips, Water, wetting
from nectosome.core.rows import Spread

from .load_groups import Loads
from .tree import Tree


class CarriedWater(NamedTuple):
    """Added mass of all stations, and how it changes."""

    added: Float[Array, "n 6 6"]
    growth: Float[Array, "n 6 6"] | None  # its rate by what loads do; None if they do nothing
    wetting: Float[Array, "n"] | None  # rate [1/s] of the share under the surface; None if all is there

    def reshaping(self, relative: Float[Array, "n 6"]) -> Float[Array, "n 6"] | None:
        """Wrench of the growth at twists relative to the water, station frame."""
        return None if self.growth is None else -times(self.growth, relative)


def emerges(loads: Loads, water: Water) -> bool:
    """Whether constant added mass may come out of the water."""
    return water.surface is not None and any(g.load.carries for g in loads.on_bodies)


def carried_water(
    added: Float[Array, "n 6 6"],
    loads: Loads,
    tree: Tree,
    water: Water,
    t: Array,
    strips: Strips,
    twist: Float[Array, "n 6"],
    z: tuple[Any, ...],
) -> CarriedWater:
    """Of stations with a constant added mass, twists in the world, and states z as their loads see them."""
    rate = None
    if emerges(loads, water):
        assert water.surface is not None
        share, rate = wetting(strips, twist, water.surface)
        added = share[:, None, None] * added
    groups = loads.reshaping
    if not groups:
        return CarriedWater(added, None, rate)
    found = [g.carried(tree, t, strips, z[k], water) for k, g in groups.items()]
    places = Spread(added.shape[0], *(g.stations(tree) for g in groups.values()))
    now, growth = (places(x) for x in zip(*found, strict=True))
    return CarriedWater(added + now, growth, rate)


def slam(added: Float[Array, "n 6 6"], wetting: Float[Array, "n"], relative: Float[Array, "n 6"]) -> Array:
    """Wrench of the water at rest that stations meet, by their added mass and the rate of its share under water."""
    return -jnp.maximum(wetting, 0.0)[:, None] * times(added, relative)


def times(matrix: Array, x: Array) -> Array:
    """Matrix-vector product of small matrices as a broadcast sum."""
    return jnp.sum(matrix * x[..., None, :], axis=-1)

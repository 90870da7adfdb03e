r"""The water that a robot carries along: its added mass, and what the change of that does.

If a load changes the shape of a body, the momentum A V of the water also changes with its added mass A, which gives the
wrench $-\dot A V$. Where the water has a surface, each station has the added mass w A, by its share w of volume under
water. Water that the body meets is at rest and takes the wrench $-\dot w A V$ for $\dot w > 0$ (von Karman 1929); water
that it leaves keeps its velocity and takes none. Both times $\tfrac12 |\dot w| V \cdot A V$ goes into the water: the
spray, the wake.
"""

from typing import TYPE_CHECKING, Any, NamedTuple

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Strips, wetting
from nectosome.core.rows import Spread

if TYPE_CHECKING:
    from .robot import Robot


class CarriedWater(NamedTuple):
    """Added mass of all stations, and how it changes."""

    added: Float[Array, "n 6 6"]
    growth: Float[Array, "n 6 6"] | None  # its rate by what loads do; None if they do nothing
    wetting: Float[Array, "n"] | None  # rate [1/s] of the share under the surface; None if all is there

    def reshaping(self, relative: Float[Array, "n 6"]) -> Float[Array, "n 6"] | None:
        """Wrench of the growth at twists relative to the water, station frame."""
        return None if self.growth is None else -times(self.growth, relative)


def carried_water(
    robot: "Robot", t: Array, strips: Strips, twist: Float[Array, "n 6"], z: tuple[Any, ...]
) -> CarriedWater:
    """Of stations with twists in the world, and states z as their loads see them."""
    constant, rate = robot.added, None
    if robot.emerges:
        assert robot.water.surface is not None
        share, rate = wetting(strips, twist, robot.water.surface)
        constant = share[:, None, None] * constant
    groups = robot.load_groups.reshaping
    if not groups:
        return CarriedWater(constant, None, rate)
    found = [g.carried(robot.tree, t, strips, z[k], robot.water) for k, g in groups.items()]
    places = Spread(robot.added.shape[0], *(g.stations(robot.tree) for g in groups.values()))
    now, growth = (places(x) for x in zip(*found, strict=True))
    return CarriedWater(constant + now, growth, rate)


def slam(added: Float[Array, "n 6 6"], wetting: Float[Array, "n"], relative: Float[Array, "n 6"]) -> Array:
    """Wrench of the water at rest that stations meet, by their added mass and the rate of its share under water."""
    return -jnp.maximum(wetting, 0.0)[:, None] * times(added, relative)


def times(matrix: Array, x: Array) -> Array:
    """Matrix-vector product of small matrices as a broadcast sum."""
    return jnp.sum(matrix * x[..., None, :], axis=-1)

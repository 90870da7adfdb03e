r"""The water that a robot carries along: its added mass, and what the change of that does.

If a load changes the shape of a body, the momentum A V of the water also changes with its added mass A, which gives the
wrench $-\dot A V$. Where the water has a surface, each station has the added mass w A, by its share w of volume under
water; a foil on a rigid part has it section by section. Water that the body meets is at rest and takes the wrench
$-\dot w A V$ for $\dot w > 0$ (von Karman 1929); water that it leaves keeps its velocity and takes none. Both times
$\tfrac12 |\dot w| V \cdot A V$ goes into the water: the spray, the wake.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import SectionedLoad, Strips, Water, wetting
from nectosome.core.rows import Spread

from .load_groups import Loads
from .tree import Tree


class AtSurface(NamedTuple):
    """Added mass in water with a surface: what is under it, and the rates at which bodies meet and leave some."""

    under: Float[Array, "n 6 6"]
    met: Float[Array, "n 6 6"]
    left: Float[Array, "n 6 6"]

    @classmethod
    def of(
        cls, added: Float[Array, "n 6 6"], t: Float[Array, ""], strips: Strips, water: Water
    ) -> "tuple[AtSurface, Float[Array, 'n']]":
        """Of what stations that move in the world would have with all of it under water; and their shares there."""
        shares = _shares(t, strips, water)
        return cls(*(x[:, None, None] * added for x in shares)), shares[0]

    @classmethod
    def of_sections(cls, load: SectionedLoad, t: Float[Array, ""], strips: Strips, water: Water) -> "AtSurface":
        """What the sections of a load have more than by the share of their part, at its first station [6 6]."""
        own, of_part = (_shares(t, x, water) for x in (load.sections(strips), strips))
        each = load.section_inertia(water)
        return cls(*(jnp.einsum("k,kij->ij", x - y[0], each) for x, y in zip(own, of_part, strict=True)))

    def slam(self, relative: Float[Array, "n 6"]) -> Float[Array, "n 6"]:
        """Wrench of the water at rest that stations meet, by their twists relative to it."""
        return -times(self.met, relative)

    def lost(self, relative: Float[Array, "n 6"]) -> Float[Array, "n"]:
        """Power [W] into the water that stations meet and leave."""
        return 0.5 * jnp.sum(relative * times(self.met + self.left, relative), axis=-1)


class CarriedWater(NamedTuple):
    """Added mass of all stations, and how it changes."""

    added: Float[Array, "n 6 6"]
    growth: Float[Array, "n 6 6"] | None  # its rate by what loads do; None if they do nothing
    surface: AtSurface | None  # None if all is under water

    def reshaping(self, relative: Float[Array, "n 6"]) -> Float[Array, "n 6"] | None:
        """Wrench of the growth at twists relative to the water, station frame."""
        return None if self.growth is None else -times(self.growth, relative)


def emerges(loads: Loads, water: Water) -> bool:
    """Whether added mass may come out of the water."""
    return water.surface is not None and (any(g.load.carries for g in loads.on_bodies) or bool(loads.reshaping))


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
    growth = None
    if groups := loads.reshaping:
        carried = [g.carried(tree, t, strips, z[k], water) for k, g in groups.items()]
        places = Spread(added.shape[0], *(g.stations(tree) for g in groups.values()))
        now, growth = (places(x) for x in zip(*carried, strict=True))
        added = added + now
    if not emerges(loads, water):
        return CarriedWater(added, growth, None)
    moving = eqx.tree_at(lambda s: s.velocity, strips, twist[:, 3:])
    there, share = AtSurface.of(added, t, moving, water)
    if groups := loads.sectioned:
        more = [g.map(lambda load, s: AtSurface.of_sections(load, t, s, water), g.here(tree, moving)) for g in groups]
        places = Spread(added.shape[0], *(g.stations(tree) for g in groups))
        there = AtSurface(*(x + places(y, (6, 6)) for x, y in zip(there, zip(*more, strict=True), strict=True)))
    return CarriedWater(there.under, None if growth is None else share[:, None, None] * growth, there)


def _shares(t: Array, strips: Strips, water: Water) -> tuple[Array, Array, Array]:
    """Share of each station under water, and the rates [1/s] at which it grows and shrinks."""
    share, rate = wetting(t, strips, jnp.concatenate([strips.angular_velocity, strips.velocity], axis=1), water)
    return share, jnp.maximum(rate, 0.0), jnp.maximum(-rate, 0.0)


def times(matrix: Array, x: Array) -> Array:
    """Matrix-vector product of small matrices as a broadcast sum."""
    return jnp.sum(matrix * x[..., None, :], axis=-1)


def counted(share: Float[Array, "n"] | None, of_stations: Float[Array, "n ..."]) -> Float[Array, "n ..."]:
    """Wrenches or inertias of stations, times the share of each that counts; all of them without shares."""
    return of_stations if share is None else (share * of_stations.T).T

"""Places on a part: points fixed to its stations, how they move, and what forces on them do to the stations."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Stations, Strips
from nectosome.core.described import number
from nectosome.core.se3 import cross, dot, dot_t
from nectosome.description import Rigid, Rod
from nectosome.mechanism import Link, SoftRod, node_at


class Carrier(NamedTuple):
    """A part that loads act on, as it is described and as it is built."""

    limb: Rigid | Rod
    body: Link | SoftRod
    stations: Stations

    @property
    def rod(self) -> SoftRod:
        """The part as a rod."""
        assert isinstance(self.body, SoftRod)
        return self.body

    @property
    def link(self) -> Link:
        """The part as a rigid one."""
        assert isinstance(self.body, Link)
        return self.body

    @property
    def length(self) -> Float[Array, ""]:
        """Length of the part; of a mesh or a plate by its outline along x [m]."""
        return 2 * self.stations.half_length[0] if self.limb.length is None else number(self.limb.length)

    def station(self, at: str | float) -> int:
        """The station of a rod at its tip, its root or a mark."""
        return len(self.rod.nodes) - 1 if at == "tip" else node_at(self.rod, at)

    def from_centre(self, place: Float[Array, "*m 3"]) -> Float[Array, "*m 3"]:
        """From the centre of a rigid part to places in the part's frame, in the centre's frame."""
        return self.at_centre(place - self.link.position[0])

    def at_centre(self, along: Float[Array, "*m 3"]) -> Float[Array, "*m 3"]:
        """Vectors in the part's frame in that of its centre."""
        return dot_t(self.link.rotation[0], along)


class WebGaps(NamedTuple):
    """Where the strips of a web lie, gap by gap."""

    reach: Float[Array, "n"]  # half chord by which the whole sheet carries water at each strip, see `sheet_reach` [m]
    length: Float[Array, ""]  # of its limbs [m]
    along: Float[np.ndarray, "k"]  # shares of the length at which strips lie along each gap
    to_all: Float[Array, "gaps 3 4"] | None  # of a ring with one limb for all: rotation and shift [m] to each gap


class SheetCarrier(NamedTuple):
    """A web or a soft plate that loads act on, as it is built."""

    stations: Stations
    carried: Float[Array, "n"]  # volume of the water that each carries as it moves across itself [m3]
    turned: Float[Array, "n"]  # the same as it turns about x [m5]
    height: Float[Array, "n"]  # shorter side of the whole sheet there [m]
    rows: tuple[int, ...]  # the row across the sheet that each belongs to, of those that share vortices
    gaps: WebGaps | None = None  # of a web; None of a soft plate


class Points(NamedTuple):
    """Points in the world and their motion, world axes."""

    position: Float[Array, "m 3"]  # [m]
    angular_velocity: Float[Array, "m 3"]  # of their stations [rad/s]
    velocity: Float[Array, "m 3"]  # [m/s]


class AttachedPlaces(eqx.Module):
    """Points of one part, each fixed to one of its stations."""

    station: tuple[int, ...] = eqx.field(static=True)
    place: Float[Array, "m 3"]  # from the station, in its frame [m]

    def points(self, strips: Strips) -> Points:
        """The points in the world."""
        here = np.asarray(self.station)
        R, w = strips.rotation[here], strips.angular_velocity[here]
        velocity = strips.velocity[here] + cross(w, self.place)
        return Points(strips.position[here] + dot(R, self.place), dot(R, w), dot(R, velocity))

    def wrenches(self, strips: Strips, force: Float[Array, "m 3"], moment: Float[Array, "m 3"]) -> Float[Array, "n 6"]:
        """Wrenches on all stations (station frames) of forces at the points and moments about them (world axes)."""
        here = np.asarray(self.station)
        R = strips.rotation[here]
        f = dot_t(R, force)
        wrench = jnp.concatenate([dot_t(R, moment) + cross(self.place, f), f], axis=-1)
        return jnp.zeros((strips.weight.shape[0], 6)).at[here].add(wrench)

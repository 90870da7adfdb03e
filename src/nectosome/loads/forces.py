"""Given forces at a point or along a rod, fixed in the world (dead) or in the body (follower)."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water
from nectosome.core.described import vector
from nectosome.core.se3 import cross, dot_t
from nectosome.description import DistributedForceLoad, ForceLoad
from nectosome.mechanism import SoftRod

from .places import Carrier


class PointForce(Load):
    """A force [N] and a moment [N m] on one station, in world axes or, as a follower, in the station's axes."""

    moment: Float[Array, "3"]
    vector: Float[Array, "3"]
    arm: Float[Array, "3"]  # from the station to the point of the force, station frame [m]
    station: int = eqx.field(static=True)
    follower: bool = eqx.field(static=True)
    described_by = ForceLoad

    @classmethod
    def from_description(cls, described: ForceLoad, part: Carrier) -> "PointForce":
        """At a station of a rod, or at the tip or the root of a rigid part."""
        station, arm = 0, jnp.zeros(3)
        if isinstance(part.body, SoftRod):
            station = part.station(described.at)
        else:
            arm = part.from_centre(part.body.tip_position if described.at == "tip" else jnp.zeros(3))
        return cls(vector(described.moment), vector(described.force), arm, station, described.frame == "body")

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the station."""
        parts = [self.moment, self.vector]
        if not self.follower:
            parts = [dot_t(strips.rotation[self.station], x) for x in parts]
        moment, f = parts
        wrench = jnp.concatenate([moment + cross(self.arm, f), f])
        return jnp.zeros((strips.weight.shape[0], 6)).at[self.station].set(wrench), z


class LineForce(Load):
    """A force per length [N/m] along a body, in world axes or, as a follower, in the sections' axes."""

    vector: Float[Array, "3"]
    follower: bool = eqx.field(static=True)
    described_by = DistributedForceLoad

    @classmethod
    def from_description(cls, described: DistributedForceLoad, part: Carrier) -> "LineForce":
        """In the axes of a description."""
        return cls(vector(described.force), described.frame == "body")

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Force on each station."""
        f = self.vector if self.follower else dot_t(strips.rotation, self.vector)
        f = strips.weight[:, None] * f
        return jnp.concatenate([jnp.zeros_like(f), f], axis=-1), z

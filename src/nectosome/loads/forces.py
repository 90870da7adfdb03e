"""Given forces: at a point or along a rod, fixed in the world (dead) or in the body (follower); measured thrust."""

from typing import Any

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Cycle, Load, Strips, Water, wetted
from nectosome.core.described import numbers, unit, vector
from nectosome.core.se3 import cross, dot_t
from nectosome.description import ForceLoad
from nectosome.description.cranks import PulsedThrustLoad
from nectosome.description.loads import DistributedForceLoad
from nectosome.mechanism import SoftRod

from .places import Carrier


class PointForce(Load):
    """A force [N] and a moment [N m] on one station, in world axes or, as a follower, in the station's axes."""

    moment: Float[Array, "3"]
    vector: Float[Array, "3"]
    arm: Float[Array, "3"]  # from the station to the point of the force, station frame [m]
    station: int = eqx.field(static=True)
    follower: bool = eqx.field(static=True)
    mild = True
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
    by_station = mild = True
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


class PulsedThrust(Load):
    r"""Measured thrust: a periodic force along a direction d, as a function of a crank angle, its state.

    $$ F = (\omega/\omega_0)^2\, F_0(\phi)\, d, \quad \dot\phi = \omega $$

    $F_0$, a periodic cubic spline, is the thrust of a fixed robot at the speed $\omega_0$; the force of a jet,
    $\rho Q^2/A$, scales with the square of the speed. Of a part in the surface there is the share of its volume under
    water, since a jet in the air has no water to push (see `Jet`). The effect of the robot's shape and speed is not
    included.
    """

    values: Float[Array, "n"]  # F_0 at equal steps over a turn, the first at angle 0 [N]
    rated: Float[Array, ""]  # omega_0 [rad/s]
    speed: Float[Array, ""]  # omega [rad/s]
    start: Float[Array, ""]  # phi at the start [rad]
    direction: Float[Array, "3"]  # d, of length 1, part frame
    place: Float[Array, "3"]  # where it acts, from the part's centre, part frame [m]
    on_first = True
    described_by = PulsedThrustLoad

    @classmethod
    def from_description(cls, described: PulsedThrustLoad, part: Carrier) -> "PulsedThrust":
        """Of a description, whose vectors are along the axes of the part."""
        return cls(
            **numbers(described, "values", "rated", "speed", "start"),
            direction=part.at_centre(unit(described.direction)),
            place=part.at_centre(vector(described.place)),
        )

    def initial(self) -> Float[Array, ""]:
        """Start angle of the crank."""
        return self.start

    def crank_speed(self) -> Float[Array, ""]:
        """That of its crank."""
        return self.speed

    def force(
        self, t: Array, strips: Strips, z: Float[Array, ""], water: Water
    ) -> tuple[Float[Array, "n 6"], Float[Array, ""]]:
        """Wrench on the centre, and the speed of the crank."""
        ratio = self.speed / self.rated
        size = ratio * ratio * Cycle(self.values, jnp.asarray(0.5 / jnp.pi), jnp.zeros(()))(z)[0]
        f = size * self.direction
        if water.surface is not None:
            f = wetted(t, strips, water)[0] * f
        return strips.at_first(jnp.concatenate([cross(self.place, f), f])), self.speed + 0.0

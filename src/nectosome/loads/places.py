"""Points fixed to the stations of a part: their motion, and wrenches on the stations of forces at the points."""

from typing import NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Strips
from nectosome.core.se3 import cross, dot, dot_t


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

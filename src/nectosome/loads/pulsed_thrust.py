"""Thrust that a turning crank makes, as it was measured over a turn."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Cycle, Load, Strips, Water
from nectosome.core.described import numbers, unit, vector
from nectosome.core.se3 import cross
from nectosome.description.loads import PulsedThrustLoad

from .places import Carrier


class PulsedThrust(Load):
    r"""A force along a direction d that goes through given values in each turn of a crank, whose angle is its state.

    $$ F = (\omega/\omega_0)^2\, F_0(\phi)\, d, \quad \dot\phi = \omega $$

    $F_0$, a periodic cubic spline, was measured at the speed $\omega_0$, on a robot that was held; the forces of a jet,
    $\rho Q^2/A$, go with the square of the speed. What shape and speed of the robot do to the thrust is not in it: a
    `Jet` has that.
    """

    values: Float[Array, "n"]  # F_0 evenly spread over a turn, the first at angle 0 [N]
    rated: Float[Array, ""]  # omega_0 [rad/s]
    speed: Float[Array, ""]  # omega [rad/s]
    start: Float[Array, ""]  # phi at the start [rad]
    direction: Float[Array, "3"]  # d, of length 1, part frame
    place: Float[Array, "3"]  # where it acts, from the part's centre, part frame [m]
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
        """The crank where it starts."""
        return self.start

    def force(
        self, t: Array, strips: Strips, z: Float[Array, ""], water: Water
    ) -> tuple[Float[Array, "n 6"], Float[Array, ""]]:
        """Wrench on the centre, and the speed of the crank."""
        ratio = self.speed / self.rated
        size = ratio * ratio * Cycle(self.values, jnp.asarray(0.5 / jnp.pi), jnp.zeros(()))(z)[0]
        f = size * self.direction
        return strips.at_first(jnp.concatenate([cross(self.place, f), f])), self.speed + 0.0

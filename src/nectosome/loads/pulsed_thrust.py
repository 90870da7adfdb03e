"""Measured thrust over a turn of a crank."""

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Cycle, Load, Strips, Water
from nectosome.core.described import numbers, unit, vector
from nectosome.core.se3 import cross
from nectosome.description.loads import PulsedThrustLoad

from .places import Carrier


class PulsedThrust(Load):
    r"""A periodic force along a direction d, as a function of a crank angle, its state.

    $$ F = (\omega/\omega_0)^2\, F_0(\phi)\, d, \quad \dot\phi = \omega $$

    $F_0$, a periodic cubic spline, is the thrust of a fixed robot at the speed $\omega_0$; the force of a jet,
    $\rho Q^2/A$, scales with the square of the speed. The effect of the robot's shape and speed is not included; see
    `Jet`.
    """

    values: Float[Array, "n"]  # F_0 at equal steps over a turn, the first at angle 0 [N]
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
        """Start angle of the crank."""
        return self.start

    def force(
        self, t: Array, strips: Strips, z: Float[Array, ""], water: Water
    ) -> tuple[Float[Array, "n 6"], Float[Array, ""]]:
        """Wrench on the centre, and the speed of the crank."""
        ratio = self.speed / self.rated
        size = ratio * ratio * Cycle(self.values, jnp.asarray(0.5 / jnp.pi), jnp.zeros(()))(z)[0]
        f = size * self.direction
        return strips.at_first(jnp.concatenate([cross(self.place, f), f])), self.speed + 0.0

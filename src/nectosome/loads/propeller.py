r"""Propellers: their thrust and torque by their speed and by the water that flows to them.

With the density $\rho$, the diameter D, the speed n in turns per second and the inflow $V_a$, the velocity of the
propeller through the water along its thrust, open-water tests give $K_T = T/(\rho n^2 D^4)$ and $K_Q = Q/(\rho n^2
D^5)$ over $J = V_a/(n D)$. Straight lines $K_T = a - b J$, $K_Q = a' - b' J$ become

$$ T = \rho D^4 |n| (a n - b V_a/D), \quad Q = \rho D^5 |n| (a' n - b' V_a/D) $$

the bilinear model of thrusters (Blanke, Lindegaard and Fossen 2000). It has no singularity at n = 0. Open-water lines
are measured in the first of the four quadrants, n > 0 and 0 < J < a/b; in the other ones they are continued. Turning
backward the propeller may have other a and a', with the same slopes. A propeller that stands still has no drag here.
"""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Load, Strips, Water, wetted
from nectosome.core.described import number, numbers, unit
from nectosome.description.propeller import ThrusterLoad

from .places import Carrier


class Thruster(Load):
    r"""Thrust T d and torque -h Q d on the part that turns with a propeller (see above).

    The speed is $n = h\, \omega \cdot d/(2 \pi)$, with the part's angular velocity $\omega$ in the world, h = 1 of a
    right-handed propeller and -1 of a left-handed one. The joint of the part carries the torque on to what holds it.
    The shaft takes $2 \pi n Q$, the thrust gives $T V_a$; the description is refused if that could be more. Of a part
    in the surface there is the share of its volume under water.
    """

    diameter: Float[Array, ""]  # D [m]
    thrust: Float[Array, ""]  # a [-]
    thrust_slope: Float[Array, ""]  # b [-]
    torque: Float[Array, ""]  # a' [-]
    torque_slope: Float[Array, ""]  # b' [-]
    backward_thrust: Float[Array, ""]  # a of n < 0 [-]
    backward_torque: Float[Array, ""]  # a' of n < 0 [-]
    direction: Float[Array, "3"]  # d, of length 1, part frame
    hand: Float[Array, ""]  # h
    dissipative = on_first = True
    described_by = ThrusterLoad

    @classmethod
    def from_description(cls, described: ThrusterLoad, part: Carrier) -> "Thruster":
        """Of a description, whose direction is along the axes of the part."""
        backward = described.backward_thrust, described.backward_torque
        thrust, torque = (
            number(own if other is None else other)
            for own, other in zip((described.thrust, described.torque), backward, strict=True)
        )
        return cls(
            **numbers(described, "diameter", "thrust", "thrust_slope", "torque", "torque_slope"),
            backward_thrust=thrust,
            backward_torque=torque,
            direction=part.at_centre(unit(described.direction)),
            hand=number(1.0 if described.hand == "right" else -1.0),
        )

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench on the centre of the part."""
        n = self.hand * jnp.sum(self.direction * strips.angular_velocity[0]) / (2 * jnp.pi)
        inflow = jnp.sum(self.direction * strips.velocity[0]) / self.diameter
        a, other = (
            jnp.where(n > 0, ahead, astern)
            for ahead, astern in ((self.thrust, self.backward_thrust), (self.torque, self.backward_torque))
        )
        scale = water.density * self.diameter**4 * jnp.abs(n) * wetted(t, strips, water)[0]
        T = scale * (a * n - self.thrust_slope * inflow)
        Q = scale * self.diameter * (other * n - self.torque_slope * inflow)
        return strips.at_first(jnp.concatenate([-self.hand * Q * self.direction, T * self.direction])), z

r"""A pulsed jet: a crank empties a chamber through a nozzle, and the chamber refills, on a moving body.

The chamber's volume V is a smooth periodic function of the crank's angle $\phi$. The flow $Q = -V'(\phi)\,\omega$
leaves with $u = Q/A$ against the thrust's direction d; A is the area of the nozzle for Q > 0, that of the inlet for Q <
0. The momentum balance in one dimension, of a body of mass M, the water in its chamber and the added mass of its bell,
with the velocity v of the chamber relative to the water:

$$ \frac{d}{dt}\left[(M + \rho V + C \rho V) v\right] = F + \rho Q |u| - \rho (Q^+ - w Q^-)\,v, \quad Q = Q^+ - Q^- $$

F is the sum of all other forces. Leaving water has the velocity v - u; entering water has the fraction w of the body's
velocity: 0 in still water, more in the body's wake. The robot's equations contain the term of the changing mass,
$-\rho (1 + C) \dot V v$, as its shape change; this load is the right side. During outflow the chamber's part of both
cancels, and the remaining part of the shape change, $C \rho Q v$, is a thrust; during refill, $-\rho (1 - w + C) |Q| v$
is a drag.

The force $\rho Q |u|$ of the refill, against the direction, is an empirical result for thrusters on a test stand
(Giorgio-Serchi et al. 2017, Fig. 8); momentum of an inflow from all directions would give zero. The inlet's area is an
effective one that reproduces measured forces: nozzle and valves together, with the contraction of the flow.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import CrankRate, CrankState, Cycle, ReshapingLoad, Signal, Strips, Water, signal_of, wetted
from nectosome.core.described import numbers, unit, vector
from nectosome.core.se3 import cross, skew
from nectosome.description.cranks import JetLoad

from .places import Carrier


class Pulse(NamedTuple):
    """State of chamber and crank at one time."""

    angle: Float[Array, ""]  # phi [rad]
    speed: Float[Array, ""]  # omega [rad/s]
    volume: Float[Array, ""]  # V [m3]
    outflow: Float[Array, ""]  # Q [m3/s], negative during refill
    jet_speed: Float[Array, ""]  # u [m/s], relative to the body; negative during refill
    pressure: Float[Array, ""]  # p = rho/2 u|u|, gauge pressure in the chamber [Pa]
    thrust: Float[Array, ""]  # rho Q |u|, of a body at rest [N]
    power: Float[Array, ""]  # p Q, power into the water [W]
    torque: Float[Array, ""]  # that turns the crank on [N m]


class Jet(ReshapingLoad):
    r"""Thrust of a pulsed jet, and the added mass of chamber and bell (see above).

    The added mass $\rho V (1 + C d d^T)$ acts at the chamber's `place` on its velocity; the water does not rotate with
    the body. The torque of the crank is $-V'(\phi) (p + E (V_{max} - V) + \tfrac12 C \rho v_d^2)$: the water's pressure
    $p = \tfrac12 \rho u |u|$, that of the elastic shell, and that of the flow around the bell, which supplies the power
    of the shape change. Where a joint turns the crank, that torque acts on the joint.

    A jet out of the water draws air: it has neither thrust nor water, and only its shell is left. As its part comes out
    the chamber drains, and as it sinks it fills, by the share of the part's volume under water: all that is in
    proportion to the water's density has this factor.
    """

    volume: Float[Array, "n"]  # V at equal steps over a turn of the crank, the first at angle 0 [m3]
    nozzle: Float[Array, ""]  # outflow area [m2]
    inlet: Float[Array, ""]  # inflow area [m2]
    bell: Float[Array, ""]  # C: added mass of the bell along the direction over the mass of the chamber's water [-]
    wake: Float[Array, ""]  # w: velocity of entering water over that of the chamber [-]
    elastance: Float[Array, ""]  # E of the shell, relaxed at the largest volume [Pa/m3]
    direction: Float[Array, "3"]  # d of the thrust, of length 1, part frame
    place: Float[Array, "3"]  # of the chamber from the part's centre [m], part frame
    crank: Signal | None  # angle as a function of time; None: that of a joint
    on_first = True
    described_by = JetLoad

    @classmethod
    def from_description(cls, described: JetLoad, part: Carrier) -> "Jet":
        """Of a description, whose vectors are along the axes of the part."""
        return cls(
            **numbers(described, "volume", "nozzle", "inlet", "bell", "wake", "elastance"),
            direction=part.at_centre(unit(described.direction)),
            place=part.at_centre(vector(described.place)),
            crank=None if described.crank is None else signal_of(described.crank),
        )

    def crank_speed(self) -> Float[Array, ""] | None:
        """That of its crank at t = 0, if no joint turns it."""
        return None if self.crank is None else self.crank(jnp.zeros(()))[1]

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Added mass of chamber and bell, and its rate [kg m2, kg m, kg]."""
        angle, speed = self._crank(t, z)
        V, slope, _ = self._volume(angle)
        # from the centre's twist to the velocity of `place`
        at = jnp.concatenate([skew(self.place).T, jnp.eye(3)], axis=1)
        one = water.density * at.T @ (jnp.eye(3) + self.bell * jnp.outer(self.direction, self.direction)) @ at
        return V * one, slope * speed * one

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Wrench of the momentum flow at the centre; torque on a crank that a joint turns."""
        if water.surface is not None:
            water = eqx.tree_at(lambda w: w.density, water, wetted(t, strips, water)[0] * water.density)
        v = strips.velocity[0] + cross(strips.angular_velocity[0], self.place)
        now = self.pulse(t, z, jnp.sum(self.direction * v), water)
        moved = now.outflow * jnp.where(now.outflow > 0, 1.0, self.wake)
        f = now.thrust * self.direction - water.density * moved * v
        wrench = strips.at_first(jnp.concatenate([cross(self.place, f), f]))
        return wrench, CrankRate(-now.torque, z.own) if isinstance(z, CrankState) else z

    def pulse(self, t: Float[Array, ""], z: Any, along: Float[Array, ""], water: Water) -> Pulse:
        """Chamber and crank at time t; `along` [m/s] is the chamber's velocity along d relative to the water."""
        angle, speed = self._crank(t, z)
        V, slope, _ = self._volume(angle)
        Q = -slope * speed
        u = Q / jnp.where(Q > 0, self.nozzle, self.inlet)
        pressure = 0.5 * water.density * u * jnp.abs(u)
        wall = pressure + self.elastance * (jnp.max(self.volume) - V) + 0.5 * self.bell * water.density * along**2
        thrust = water.density * Q * jnp.abs(u)
        return Pulse(angle, speed, V, Q, u, pressure, thrust, pressure * Q, -slope * wall)

    def _volume(self, angle: Array) -> tuple[Array, Array, Array]:
        """Volume and its derivatives by the angle."""
        return Cycle(self.volume, jnp.asarray(0.5 / jnp.pi), jnp.zeros(()))(angle)

    def _crank(self, t: Array, z: Any) -> tuple[Array, Array]:
        """Angle and speed."""
        if self.crank is not None:
            return self.crank(t)[:2]
        assert isinstance(z, CrankState)
        return z.angle, z.speed

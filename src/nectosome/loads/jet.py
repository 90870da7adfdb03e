r"""A pulsed jet: a chamber that a crank empties through a nozzle and that fills again, on a body that may swim.

The crank's angle $\phi$ says the chamber's volume V, a smooth periodic function, so that $Q = -V'(\phi)\,\omega$ flows
out with $u = Q/A$ against the thrust's direction d; A is that of the nozzle for Q > 0, that of the inlet for Q < 0. The
momentum of a body of mass M, of the water in its chamber and of that which its bell carries along outside, with the
velocity v of the chamber against the water, in one dimension:

$$ \frac{d}{dt}\left[(M + \rho V + C \rho V) v\right] = F + \rho Q |u| - \rho (Q^+ - w Q^-)\,v, \quad Q = Q^+ - Q^- $$

F is all else that acts. Water that leaves has the velocity v - u and takes it along; water that comes in has
the share w of the body's velocity already: 0 in still water, more in a wake that the body drags along. The robot's
equations book the changing mass, $-\rho (1 + C) \dot V v$, as its change of shape; this load books the right side.
While water leaves, the chamber's part of both cancels, and what is left of the change of shape, $C \rho Q v$, pushes;
while it fills, $-\rho (1 - w + C) |Q| v$ holds back.

$\rho Q |u|$ of the refill, against the direction, is what held thrusters of this kind are found to give (Giorgio-Serchi
et al. 2017, Fig. 8); momentum alone, of a flow that comes from everywhere, would give nothing. So the inlet's area is
one that makes measured forces true, of nozzle and valves together, narrowed by the contraction of the flow.
"""

from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Cycle, Load, Signal, Strips, Water, signal_of
from nectosome.core.described import numbers, same_named, unit, vector
from nectosome.core.se3 import cross, skew
from nectosome.description.loads import JetLoad

from .places import Carrier


class Motor(eqx.Module):
    """A DC motor with its gear, as the crank feels it: torque falls evenly with speed, current goes with torque."""

    stall_torque: Float[Array, ""]  # T_s [N m]
    no_load_speed: Float[Array, ""]  # omega_0 [rad/s]
    stall_current: Float[Array, ""]  # [A]
    inertia: Float[Array, ""]  # I of crank, gear and rotor [kg m2]
    angle: Float[Array, ""]  # at the start [rad]
    speed: Float[Array, ""]  # at the start [rad/s]

    def torque(self, speed: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """T_s (1 - omega/omega_0) [N m]; it brakes a crank that is faster."""
        return self.stall_torque * (1 - speed / self.no_load_speed)

    def current(self, speed: Float[Array, "*n"]) -> Float[Array, "*n"]:
        """Current [A] in proportion to the torque."""
        return self.stall_current * (1 - speed / self.no_load_speed)


class Pulse(NamedTuple):
    """What chamber and crank do at one instant."""

    angle: Float[Array, ""]  # phi [rad]
    speed: Float[Array, ""]  # omega [rad/s]
    volume: Float[Array, ""]  # V [m3]
    outflow: Float[Array, ""]  # Q [m3/s], negative while it fills
    jet_speed: Float[Array, ""]  # u [m/s], against the body; negative while it fills
    pressure: Float[Array, ""]  # p = rho/2 u|u| of the water in the chamber over that outside [Pa]
    thrust: Float[Array, ""]  # rho Q |u|, that of a held body [N]
    power: Float[Array, ""]  # p Q that the water takes [W]
    torque: Float[Array, ""]  # that the crank takes [N m]


class Jet(Load):
    r"""Thrust of a pulsed jet, and the water that chamber and bell carry along (see above).

    What is carried acts at the chamber's `place`: $\rho V (1 + C d d^T)$ on its velocity; the water turns freely. The
    crank takes the torque $-V'(\phi) (p + E (V_{max} - V) + \tfrac12 C \rho v_d^2)$: the water's pressure
    $p = \tfrac12 \rho u |u|$, that of the elastic shell, and that of the stream around the bell, without which the
    power of the change of shape would come from nowhere. With a `Motor`, angle and speed of the crank are the state,
    $I \dot\omega = T - torque$. The jet stays under water.
    """

    volume: Float[Array, "n"]  # V evenly spread over a turn of the crank, the first at angle 0 [m3]
    nozzle: Float[Array, ""]  # area that water leaves by [m2]
    inlet: Float[Array, ""]  # area that it comes in by [m2]
    bell: Float[Array, ""]  # C: added mass of the bell along the direction, in masses of the chamber's water [-]
    wake: Float[Array, ""]  # w: share of the chamber's velocity that water coming in has [-]
    elastance: Float[Array, ""]  # E of the shell, at ease at the largest of the volumes [Pa/m3]
    direction: Float[Array, "3"]  # d of the thrust, of length 1, part frame
    place: Float[Array, "3"]  # of the chamber from the part's centre [m], part frame
    crank: Signal | Motor  # angle as a function of time, or what turns it
    described_by = JetLoad

    @classmethod
    def from_description(cls, described: JetLoad, part: Carrier) -> "Jet":
        """Of a description, whose vectors are along the axes of the part."""
        assert described.motor is not None or described.crank is not None
        return cls(
            **numbers(described, "volume", "nozzle", "inlet", "bell", "wake", "elastance"),
            direction=part.at_centre(unit(described.direction)),
            place=part.at_centre(vector(described.place)),
            crank=signal_of(described.crank) if described.crank is not None else same_named(Motor, described.motor),
        )

    def initial(self) -> Any:
        """Angle and speed of a crank that a motor turns."""
        return jnp.stack([self.crank.angle, self.crank.speed]) if isinstance(self.crank, Motor) else ()

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Water of the chamber and that carried by the bell, and its rate [kg m2, kg m, kg]."""
        angle, speed = self._crank(t, z)
        V, slope, _ = self._volume(angle)
        at = jnp.concatenate([skew(self.place).T, jnp.eye(3)], axis=1)  # velocity of the place by the centre's twist
        one = water.density * at.T @ (jnp.eye(3) + self.bell * jnp.outer(self.direction, self.direction)) @ at
        return V * one, slope * speed * one

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Momentum that flows through the openings, at the centre; angular speed and acceleration of the crank."""
        v = strips.velocity[0] + cross(strips.angular_velocity[0], self.place)
        now = self.pulse(t, z, jnp.sum(self.direction * v), water)
        moved = now.outflow * jnp.where(now.outflow > 0, 1.0, self.wake)
        f = now.thrust * self.direction - water.density * moved * v
        wrench = jnp.zeros((strips.weight.shape[0], 6)).at[0].set(jnp.concatenate([cross(self.place, f), f]))
        if isinstance(self.crank, Motor):
            z = jnp.stack([now.speed, (self.crank.torque(now.speed) - now.torque) / self.crank.inertia])
        return wrench, z

    def pulse(self, t: Float[Array, ""], z: Any, along: Float[Array, ""], water: Water) -> Pulse:
        """Chamber and crank at time t where the chamber moves with `along` [m/s] in its direction against the water."""
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
        return (z[0], z[1]) if isinstance(self.crank, Motor) else self.crank(t)[:2]

"""Increase of a rigid body's added mass and drag near the floor."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import REFERENCE_DENSITY, ReshapingLoad, Strips, Water, wetted
from nectosome.core.described import number, vector
from nectosome.description.loads import NearFloorLoad

from .places import Carrier


class NearFloor(ReshapingLoad):
    r"""Additional added mass and drag near the floor, as functions of the height h above it.

    The factor $s(h)$ is 1 up to `full`, 0 above `none`, and $1 - 3 x^2 + 2 x^3$ between, with
    $x = (h - full)/(none - full)$. Drag is $F_i = -\tfrac12 s \rho A_i |v_i| v_i$, $M_i = -s \rho c_i |w_i| w_i$. With
    the added mass s m, diagonal in the body frame, the water's kinetic energy $T = \tfrac12 s\, v \cdot m v$ depends on
    the position; Lagrange's equations then contain the force $\partial T/\partial h = \tfrac12 s'(h)\, v \cdot m v$
    upwards beside the rate of momentum (Lamb 1932, art. 136-137), which conserves energy. Zero without a floor.

    Of a body in the surface all of it has the share of its volume that is under water.
    """

    mass: Float[Array, "3"]  # m along local x, y, z [kg]
    drag_area: Float[Array, "3"]  # drag areas A [m2]
    rotational: Float[Array, "3"]  # c [m5]
    full: Float[Array, ""]  # height up to which all of it is there [m]
    none: Float[Array, ""]  # height from which on nothing is [m]
    on_first = True
    described_by = NearFloorLoad

    @classmethod
    def from_description(cls, described: NearFloorLoad, part: Carrier) -> "NearFloor":
        """Of the moments in water of the reference density."""
        vectors = vector(described.mass), vector(described.drag_area), vector(described.rotational) / REFERENCE_DENSITY
        return cls(*vectors, number(described.full), number(described.none))

    def carried(
        self, t: Float[Array, ""], strips: Strips, z: Any, water: Water
    ) -> tuple[Float[Array, "6 6"], Float[Array, "6 6"]]:
        """Added mass at this height, and its rate [kg]."""
        share, slope = self.share(strips, water)
        v = strips.velocity[0]
        climb = sum(strips.rotation[0, 2, i] * v[i] for i in range(3))
        if water.current is not None:
            climb = climb + water.flow(t, strips.position[:1])[0][0, 2]
        one = jnp.diag(jnp.concatenate([jnp.zeros(3), self.mass]))
        return share * one, slope * climb * one

    def share(self, strips: Strips, water: Water) -> tuple[Float[Array, ""], Float[Array, ""]]:
        """Factor s at the height of the first station, and its derivative [1/m]."""
        if water.floor is None:
            return jnp.zeros(()), jnp.zeros(())
        width = self.none - self.full
        x = jnp.clip((strips.position[0, 2] - water.floor - self.full) / width, 0.0, 1.0)
        return 1 - x * x * (3 - 2 * x), -6 * x * (1 - x) / width

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Drag, and the upward derivative of the water's energy, on the first station."""
        share, slope = (wetted(strips, water)[0] * x for x in self.share(strips, water))
        v, w, up = strips.velocity[0], strips.angular_velocity[0], strips.rotation[0, 2]
        lift = 0.5 * slope * sum(self.mass[i] * v[i] * v[i] for i in range(3))
        dense = share * water.density
        moment = [-dense * self.rotational[i] * jnp.abs(w[i]) * w[i] for i in range(3)]
        force = [lift * up[i] - 0.5 * dense * self.drag_area[i] * jnp.abs(v[i]) * v[i] for i in range(3)]
        return strips.at_first(jnp.stack([*moment, *force])), z

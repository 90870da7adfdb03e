"""Contact of a body with the walls of a tank."""

from typing import Any

import jax.numpy as jnp
from jaxtyping import Array, Float

from nectosome.core import Gaps, Load, Strips, Water
from nectosome.description.loads import WallContactLoad


class WallContact(Load):
    r"""Compliant contact with the walls of the tank, which are normal to the world's x axis.

    The ends of the body are `reach` ahead of and behind the centre. At penetration $\delta$ with the velocity v into
    the wall, the force is

    $$ F = \max(k \delta + \xi c v,\ 0), \quad \xi = \min(\delta/\delta_0, 1) $$

    away from it, through the centre, without friction. Zero without walls.
    """

    reach: Float[Array, ""]  # [m]
    stiffness: Float[Array, ""]  # k [N/m]
    damping: Float[Array, ""]  # c [N s/m]
    softness: Float[Array, ""]  # delta_0 [m]
    on_first = True
    described_by = WallContactLoad

    def depths(self, x: Float[Array, ""], water: Water) -> Float[Array, "2"]:
        """Penetration of a body with its centre at x into the first and the second wall [m]; negative: no contact."""
        assert water.walls is not None
        return jnp.stack([water.walls[0] - x + self.reach, x + self.reach - water.walls[1]])

    def gaps(self, strips: Strips, z: Any, water: Water) -> Gaps | None:
        """Distances to the walls."""
        if water.walls is None:
            return None
        gap = -self.depths(strips.position[0, 0], water) / self.softness
        return Gaps.of(gap, self.stiffness, self.damping, ramp=True)

    def force(self, t: Array, strips: Strips, z: Any, water: Water) -> tuple[Float[Array, "n 6"], Any]:
        """Force of the walls on the centre."""
        if water.walls is None:
            return jnp.zeros((strips.weight.shape[0], 6)), z
        v, R = strips.velocity[0], strips.rotation[0]
        speed = sum(R[0, i] * v[i] for i in range(3))
        if water.current is not None:
            speed = speed + water.flow(t, strips.position[:1])[0][0, 0]
        depth = self.depths(strips.position[0, 0], water)
        into = jnp.stack([-speed, speed])
        grip = jnp.clip(depth / self.softness, 0.0, 1.0)
        push = jnp.maximum(self.stiffness * jnp.maximum(depth, 0.0) + grip * self.damping * into, 0.0)
        fx = push[0] - push[1]
        none = jnp.zeros(())
        return strips.at_first(jnp.stack([none, none, none, *(R[0, i] * fx for i in range(3))])), z

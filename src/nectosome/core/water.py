"""The water around a robot: density, gravity, free surface, floor, walls, current."""

from collections.abc import Callable

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

STANDARD_GRAVITY = 9.80665  # [m/s2], by definition (CGPM 1901)
REFERENCE_DENSITY = 1000.0  # [kg/m3], of the water for which descriptions give what goes with the water's density

Current = Callable[[Float[Array, ""], Float[Array, "3"]], Float[Array, "3"]]


class UniformCurrent(eqx.Module):
    """A constant, uniform velocity."""

    velocity: Float[Array, "3"]  # [m/s], world frame

    def __call__(self, t: Float[Array, ""], x: Float[Array, "3"]) -> Float[Array, "3"]:
        """Velocity of the water at time t and point x, world frame [m/s]."""
        return self.velocity


class Water(eqx.Module):
    """Still or flowing water; z is up."""

    density: Float[Array, ""]  # [kg/m3]
    gravity: Float[Array, ""]  # [m/s2], along -z
    surface: Float[Array, ""] | None = None  # height of the free surface [m]; None: deep water
    current: Current | None = None  # velocity of the water (t, x) -> [m/s], world frame; None: still
    floor: Float[Array, ""] | None = None  # height of the ground for legs [m]; None: no ground
    walls: tuple[Float[Array, ""], Float[Array, ""]] | None = None  # x of the tank's walls [m]; None: no walls
    viscosity: Float[Array, ""] = eqx.field(default_factory=lambda: jnp.asarray(1.0016e-3))  # [Pa s], as by description

    def flow(self, t: Float[Array, ""], x: Float[Array, "n 3"]) -> tuple[Float[Array, "n 3"], Float[Array, "n 3"]]:
        """Velocity c [m/s] of the water at points x and its material rate Dc/Dt = dc/dt + (c . grad) c [m/s2]."""
        current = self.current
        if current is None:
            return jnp.zeros_like(x), jnp.zeros_like(x)

        def at(point: Array) -> tuple[Array, Array]:
            c = current(t, point)
            return jax.jvp(current, (t, point), (jnp.ones_like(t), c))

        return jax.vmap(at)(x)

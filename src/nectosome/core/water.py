"""The water around a robot: density, gravity, free surface, floor, walls, current."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float

from .flow_fields import Current, FlowFields, Waves

STANDARD_GRAVITY = 9.80665  # [m/s2], by definition (CGPM 1901)
REFERENCE_DENSITY = 1000.0  # [kg/m3], of the water for which descriptions give what goes with the water's density


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

    @property
    def steady(self) -> bool:
        """Whether its velocity depends on the place only."""
        return not isinstance(self.current, FlowFields) or all(field.steady for field in self.current.others)

    @property
    def waves(self) -> tuple[Waves, ...]:
        """Waves of its surface."""
        fields = self.current.others if isinstance(self.current, FlowFields) else ()
        return tuple(field for field in fields if isinstance(field, Waves))

    def plane(self, t: Float[Array, ""], x: Float[Array, "n 3"]) -> tuple[Float[Array, "n"], Float[Array, "n 3"]]:
        """Depth [m] of points x under the plane of the surface over each, along its normal, and the normal, upwards."""
        assert self.surface is not None
        surface, waves = self.surface, self.waves
        if not waves:
            return surface - x[:, 2], jnp.broadcast_to(jnp.array([0.0, 0.0, 1.0]), x.shape)
        height = jax.value_and_grad(lambda x: sum((each.elevation(t, x) for each in waves), surface))
        level, slope = jax.vmap(height)(x[:, :2])
        normal = jnp.concatenate([-slope, jnp.ones_like(level)[:, None]], axis=1)
        normal = normal / jnp.sqrt(jnp.sum(normal * normal, axis=1, keepdims=True))
        return (level - x[:, 2]) * normal[:, 2], normal

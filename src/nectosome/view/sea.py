"""The moving water in pictures: how high its surface is, and how it flows."""

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float

from nectosome.core import Waves, current_of
from nectosome.description import WaterDescription


class Sea:
    """The water of a robot that has `waves` or that `streams`, or neither."""

    def __init__(self, water: WaterDescription):
        current = current_of(water)
        waves = [x for x in getattr(current, "others", ()) if isinstance(x, Waves)]
        self.streams, self.waves = current is not None, bool(waves)

        @jax.jit
        def rise(t: Array, x: Array) -> Array:
            return jax.vmap(lambda x: sum(each.elevation(t, x) for each in waves) + jnp.zeros(()))(x)

        @jax.jit
        def velocity(t: Array, x: Array) -> Array:
            return jnp.zeros(3) if current is None else current(t, x)

        self._rise, self._velocity = rise, velocity

    def rise(self, time: float, points: Float[np.ndarray, "*n 3"]) -> Float[np.ndarray, "*n"]:
        """Height of the surface over that at rest above or below points [m]."""
        if not self.waves:
            return np.zeros(points.shape[:-1])
        flat = points.reshape(-1, 3)[:, :2]
        padded = np.zeros((2 ** int(np.ceil(np.log2(max(len(flat), 64)))), 2))  # few sizes: each one is compiled
        padded[: len(flat)] = flat
        found = np.asarray(self._rise(np.asarray(time), padded))
        return found[: len(flat)].reshape(points.shape[:-1])

    def velocity(self, time: float, point: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
        """Velocity of the water [m/s]."""
        return np.asarray(self._velocity(np.asarray(time), np.asarray(point)))

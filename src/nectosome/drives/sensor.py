"""A sensor with noise and a range."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.core import Line, RateIndependent


class Sensor(RateIndependent):
    """Reads its input with normal noise, a new one each sample, and gives the end of its range beyond it."""

    noise: Float[Array, ""]  # standard deviation, in the input's unit
    low: Float[Array, ""]
    high: Float[Array, ""]
    seed: Int[Array, ""] = eqx.field(default_factory=lambda: jnp.zeros((), dtype=int))

    def initial(self) -> Array:
        """The key that noise is drawn from."""
        return jax.random.key(self.seed)

    def step(self, state: Array, u: Line) -> tuple[Array, Line]:
        """Both ends, with the same noise."""
        state, key = jax.random.split(state)
        error = self.noise * jax.random.normal(key)
        return state, Line(*(jnp.clip(x + error, self.low, self.high) for x in u))

"""A sensor with noise and a range."""

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from nectosome.core import Line, RateIndependent


class Sensor(RateIndependent):
    """Reads its input with normal noise, drawn for each sample, clipped to its range."""

    noise: Float[Array, ""]  # standard deviation, in the input's unit
    low: Float[Array, ""]
    high: Float[Array, ""]
    seed: Int[Array, ""] = eqx.field(default_factory=lambda: jnp.zeros((), dtype=int))

    def initial(self) -> Array:
        """Random key of the noise."""
        return jax.random.key(self.seed)

    def step(self, state: Array, u: Line) -> tuple[Array, Line]:
        """Both ends, with the same noise. Without noise none is drawn, since that takes longer than most loops."""

        def drawn(state: Array) -> tuple[Array, Array]:
            state, key = jax.random.split(state)
            return state, self.noise * jax.random.normal(key)

        state, error = jax.lax.cond(self.noise == 0, lambda state: (state, jnp.zeros(())), drawn, state)
        return state, Line(*(jnp.clip(x + error, self.low, self.high) for x in u))

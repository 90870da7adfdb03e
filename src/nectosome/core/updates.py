r"""Instants at which sampled loops update: t = k/rate, k = 0, 1, 2, ...

Steps end there, so that times differ from them by rounding alone: those within $10^{-12} \max(1\,\mathrm{s}, t)$ of one
are that instant.
"""

import jax.numpy as jnp
from jaxtyping import Array, Bool, Float


def rounding(t: Float[Array, "*n"]) -> Float[Array, "*n"]:
    """Difference [s] of times near t that are one instant."""
    return 1e-12 * jnp.maximum(1.0, jnp.abs(t))


def next_update(t: Float[Array, ""], rates: Float[Array, "k"]) -> Float[Array, ""]:
    """First instant after t [s] at which a loop of these rates [Hz] updates."""
    return jnp.min((jnp.floor((t + rounding(t)) * rates) + 1) / rates)


def due(t: Float[Array, ""], rate: Float[Array, "*k"]) -> Bool[Array, "*k"]:
    """Whether t is an instant at which a loop of this rate updates."""
    return t - jnp.floor((t + rounding(t)) * rate) / rate <= rounding(t)

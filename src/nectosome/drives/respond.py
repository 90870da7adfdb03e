"""Response of a block to samples."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line


def respond(
    block: Block,
    u: Float[ArrayLike, "samples *channels"],
    dt: Float[ArrayLike, ""],
    hold: Literal["first", "zero"] = "first",
) -> Float[Array, "samples *outputs"]:
    """Output at the sample times k dt, from rest.

    `hold` is "first" (linear interpolation) for recordings, "zero" (zero-order hold) for commands. An output that jumps
    with its input has the value after the jump.
    """
    return _run(block, jnp.asarray(u, dtype=float), jnp.asarray(dt, dtype=float), hold)


@eqx.filter_jit
def _run(block: Block, u: Array, dt: Array, hold: str) -> Array:
    stepper = block.sampled(dt)
    after = u if hold == "zero" else jnp.concatenate([u[1:], u[-1:]])

    def one(state, line):
        state, y = stepper.step(state, line)
        return state, y.begin

    return jax.lax.scan(one, stepper.initial(), Line(u, after))[1]

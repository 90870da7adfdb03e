"""Compositions of blocks (in series, in parallel, antagonistic chambers), and the response of a block to samples."""

from typing import Literal

import equinox as eqx
import jax
import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Memoryless, Stepper

from .hysteresis import Envelope


class _Several(Stepper):
    steppers: tuple[Stepper, ...]

    def initial(self) -> tuple:
        """Initial states of all blocks."""
        return tuple(one.initial() for one in self.steppers)


class Chain(Block):
    """Blocks in series: the output of each is the input of the next."""

    blocks: tuple[Block, ...]

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """All blocks, sampled."""
        return _Series(tuple(block.sampled(dt) for block in self.blocks))


class _Series(_Several):
    def step(self, state: tuple, u: Line) -> tuple[tuple, Line]:
        """Step all blocks in turn."""
        after = []
        for one, own in zip(self.steppers, state, strict=True):
            own, u = one.step(own, u)
            after.append(own)
        return tuple(after), u


class Parallel(Block):
    """Blocks in parallel, each with its own channel of the input; the output is their sum."""

    blocks: tuple[Block, ...]

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """All blocks, sampled."""
        return _Sum(tuple(block.sampled(dt) for block in self.blocks))


class _Sum(_Several):
    def step(self, state: tuple, u: Line) -> tuple[tuple, Line]:
        """Step each block with its own channel."""
        parts = [
            one.step(own, Line(u.begin[k], u.end[k]))
            for k, (one, own) in enumerate(zip(self.steppers, state, strict=True))
        ]
        lines = [line for _, line in parts]
        return tuple(own for own, _ in parts), Line(_total([x.begin for x in lines]), _total([x.end for x in lines]))


def _total(parts: list[Array]) -> Array:
    return jnp.sum(jnp.stack(parts), axis=0)


class Gain(Memoryless):
    """The input times a gain, or times several gains for as many channels."""

    by: Float[Array, "*channels"]

    def value(self, u: Float[Array, "*channels"]) -> Float[Array, "*channels"]:
        """The input, scaled."""
        return self.by * u


class Curve(Memoryless):
    """A function of the current input."""

    of: Envelope

    def value(self, u: Float[Array, ""]) -> Float[Array, ""]:
        """Its value."""
        return self.of(u)


def antagonistic(left: Block, right: Block, opposite: bool = True) -> Block:
    """Two chambers that bend a body to either side: the effect of the left one minus that of the right one.

    With opposite pressures there is one input, +u for the left and -u for the right; else the input is (left, right).
    """
    against = Parallel((left, Chain((right, Gain(-jnp.ones(()))))))
    return Chain((Gain(jnp.array([1.0, -1.0])), against)) if opposite else against


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

"""Blocks made of blocks: one after the other, side by side, and chambers that work against each other."""

import jax.numpy as jnp
from jaxtyping import Array, ArrayLike, Float

from nectosome.core import Block, Line, Memoryless, Stepper

from .hysteresis import Envelope


class _Several(Stepper):
    steppers: tuple[Stepper, ...]

    def initial(self) -> tuple:
        """Of each."""
        return tuple(one.initial() for one in self.steppers)


class Chain(Block):
    """Blocks one after the other: the output of each is the next one's input."""

    blocks: tuple[Block, ...]

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """All of them."""
        return _InTurn(tuple(block.sampled(dt) for block in self.blocks))


class _InTurn(_Several):
    def step(self, state: tuple, u: Line) -> tuple[tuple, Line]:
        """Through all of them."""
        after = []
        for one, own in zip(self.steppers, state, strict=True):
            own, u = one.step(own, u)
            after.append(own)
        return tuple(after), u


class Parallel(Block):
    """Blocks side by side, each with its own channel of the input; the output is the sum."""

    blocks: tuple[Block, ...]

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """All of them."""
        return _Sum(tuple(block.sampled(dt) for block in self.blocks))


class _Sum(_Several):
    def step(self, state: tuple, u: Line) -> tuple[tuple, Line]:
        """Each with its own channel."""
        parts = [
            one.step(own, Line(u.begin[k], u.end[k]))
            for k, (one, own) in enumerate(zip(self.steppers, state, strict=True))
        ]
        lines = [line for _, line in parts]
        return tuple(own for own, _ in parts), Line(_total([x.begin for x in lines]), _total([x.end for x in lines]))


def _total(parts: list[Array]) -> Array:
    return jnp.sum(jnp.stack(parts), axis=0)


class Gain(Memoryless):
    """The input times numbers: one number scales it, several make as many channels of it."""

    by: Float[Array, "*channels"]

    def value(self, u: Float[Array, "*channels"]) -> Float[Array, "*channels"]:
        """The input, scaled."""
        return self.by * u


class Curve(Memoryless):
    """A function of the input as it is now."""

    of: Envelope

    def value(self, u: Float[Array, ""]) -> Float[Array, ""]:
        """Its value."""
        return self.of(u)


def antagonistic(left: Block, right: Block, opposite: bool = True) -> Block:
    """Two chambers that bend a body to either side: what the left one does less what the right one does.

    With opposite pressures the input is one, +u for the left and -u for the right; else it is (left, right).
    """
    against = Parallel((left, Chain((right, Gain(-jnp.ones(()))))))
    return Chain((Gain(jnp.array([1.0, -1.0])), against)) if opposite else against

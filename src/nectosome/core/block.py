"""The contract of blocks: systems other than mechanisms, with sampled inputs and outputs."""

from abc import abstractmethod
from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float


class Line(NamedTuple):
    """A quantity within a sample: linear between its values at both ends; it may jump between samples."""

    begin: Float[Array, "*channels"]
    end: Float[Array, "*channels"]


class Stepper(eqx.Module):
    """A block for a fixed sample length."""

    @abstractmethod
    def initial(self) -> Any:
        """State at rest, after a zero input."""

    @abstractmethod
    def step(self, state: Any, u: Line) -> tuple[Any, Line]:
        """State at the end of a sample, and the output within it, for the input within it."""


class Block(eqx.Module):
    """A causal system with an input and an output; `tests/drives/test_blocks.py` tests every block.

    Structure is static, numbers are traced.
    """

    @abstractmethod
    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """The block for samples of length dt [s]; computes all that depends on dt only."""


class RateIndependent(Block, Stepper):
    """A rate-independent block: the output depends on the path of the input, not on its speed."""

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """Return itself: the sample length has no effect."""
        return self


class Pointwise(RateIndependent):
    """A rate-independent block of which each value of the input gives the next state and the output."""

    @abstractmethod
    def at(self, state: Any, u: Float[Array, "*channels"]) -> tuple[Any, Float[Array, "*outputs"]]:
        """State and output after the input has gone to u, monotonically."""

    def step(self, state: Any, u: Line) -> tuple[Any, Line]:
        """State after both ends, and the outputs there."""
        state, begin = self.at(state, u.begin)
        state, end = self.at(state, u.end)
        return state, Line(begin, end)


class Memoryless(Pointwise):
    """A block whose output depends on the current input only."""

    @abstractmethod
    def value(self, u: Float[Array, "*channels"]) -> Float[Array, "*outputs"]:
        """Output for an input."""

    def initial(self) -> tuple[()]:
        """Empty state."""
        return ()

    def at(self, state: tuple[()], u: Float[Array, "*channels"]) -> tuple[tuple[()], Float[Array, "*outputs"]]:
        """Value at u."""
        return (), self.value(u)

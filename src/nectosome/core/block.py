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


class Memoryless(RateIndependent):
    """A block whose output depends on the current input only."""

    @abstractmethod
    def value(self, u: Float[Array, "*channels"]) -> Float[Array, "*outputs"]:
        """Output for an input."""

    def initial(self) -> tuple[()]:
        """Empty state."""
        return ()

    def step(self, state: tuple[()], u: Line) -> tuple[tuple[()], Line]:
        """Values at both ends."""
        return (), Line(self.value(u.begin), self.value(u.end))

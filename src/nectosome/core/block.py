"""The contract of blocks: what is no mechanism takes samples in and gives samples out."""

from abc import abstractmethod
from typing import Any, NamedTuple

import equinox as eqx
from jaxtyping import Array, ArrayLike, Float


class Line(NamedTuple):
    """A quantity within a sample: its values at both ends, straight between; it may jump from sample to sample."""

    begin: Float[Array, "*channels"]
    end: Float[Array, "*channels"]


class Stepper(eqx.Module):
    """A block for samples of one length."""

    @abstractmethod
    def initial(self) -> Any:
        """State at rest, after an input that was 0 for ever."""

    @abstractmethod
    def step(self, state: Any, u: Line) -> tuple[Any, Line]:
        """State at the end of a sample, and the output within it, from the input within it."""


class Block(eqx.Module):
    """What answers an input over time; `tests/drives/test_blocks.py` holds every block to it.

    The output depends on no later input, at any state. Structure is static, numbers are traced.
    """

    @abstractmethod
    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """The block for samples of a length [s]; all that depends on the length alone is worked out here."""


class RateIndependent(Block, Stepper):
    """What answers in the same way at any speed: its output follows the ways the input went, not how fast."""

    def sampled(self, dt: Float[ArrayLike, ""]) -> Stepper:
        """Itself: the length of a sample does not matter."""
        return self


class Memoryless(RateIndependent):
    """What answers an input as it is now."""

    @abstractmethod
    def value(self, u: Float[Array, "*channels"]) -> Float[Array, "*outputs"]:
        """Output at an input."""

    def initial(self) -> tuple[()]:
        """There is no state."""
        return ()

    def step(self, state: tuple[()], u: Line) -> tuple[tuple[()], Line]:
        """Values at both ends."""
        return (), Line(self.value(u.begin), self.value(u.end))

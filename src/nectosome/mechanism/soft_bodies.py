"""What soft parts share: coordinates of their own shape, and how their stations move by these."""

from abc import abstractmethod
from typing import Any, ClassVar

import equinox as eqx
from jaxtyping import Array, Float


class SoftBody(eqx.Module):
    """A part that bends by its own coordinates q; its first station is its root frame, its last one its tip.

    Each other station has a segment: the motion that q adds to it. `star` says against what: the root, else the station
    before.
    """

    names: tuple[str, ...] = eqx.field(static=True)  # of the coordinates
    stiffness: Float[Array, "nq nq"]  # generalised
    damping: Float[Array, "nq nq"]
    star: ClassVar[bool]

    @property
    def nq(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @abstractmethod
    def shape(self, q: Float[Array, "nq"]) -> Any:
        """Its shape relative to its root frame, with `rotation` [n 3 3] and `position` [n 3] of all stations."""

    @abstractmethod
    def added(self, shape: Any, v: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        """Twist increment of each segment, in the frame of the station that it starts from; linear in v."""

    @abstractmethod
    def added_rate(self, shape: Any, v: Float[Array, "nq"], a: Float[Array, "nq"]) -> Float[Array, "k 6"]:
        """Rate of `added`, of rates v that change at a."""

    @abstractmethod
    def bending(self, half_width: Float[Array, "n 2"], q: Float[Array, "nq"]) -> Float[Array, "2 n 2"]:
        """Two bending strains at each station by the half widths there, and their stresses [Pa]."""

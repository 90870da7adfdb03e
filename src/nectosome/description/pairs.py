"""Pairs: what acts between two parts, neither of which need carry the other."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import model_validator

from nectosome.description.base import ZERO, Name, Place, Position, Rotation
from nectosome.description.fields import (
    AngularDamping,
    AngularStiffness,
    Damping,
    Length,
    NonNegativeNumber,
    PositiveSpeed,
    PositiveStiffness,
)
from nectosome.description.parts import Limb, Rigid, has_place
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.units import did_you_mean


class PairDescription(Described):
    """What acts `between` two parts."""

    kind: Any  # its name in a file, a literal of each class
    between: tuple[Name, Name]

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for parts that it does not act between."""


class BushingPair(PairDescription):
    """A stiff bushing that holds a place of one part to a place of another, as in a loop of bodies.

    Each place is `at` the tip, the root or a mark of its part, moved by `offset` [m] along the axes there. `stiffness`
    [N/m] and `damping` [N s/m] are against their distance: the two are apart by the force over the stiffness. Without
    more it is a ball joint; `turning_stiffness` [N m/rad] and `turning_damping` [N m s/rad] make it a weld, in which
    the second place is turned by `rotation` (roll, pitch, yaw) [rad] against the first.
    """

    kind: Literal["bushing"]
    at: tuple[Place, Place] = ("tip", "tip")
    offset: tuple[Position, Position] = (ZERO, ZERO)
    rotation: Rotation = ZERO
    stiffness: PositiveStiffness
    damping: Damping = 0.0
    turning_stiffness: AngularStiffness = 0.0
    turning_damping: AngularDamping = 0.0

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for a mark that a part does not have."""
        for i, (name, part, at) in enumerate(zip(self.between, parts, self.at, strict=True)):
            if not has_place(part, at):
                raise wrong(f"at.{i}", f"{name} has no mark at {at}. Write tip or root, or add the mark.")


class ContactPair(PairDescription):
    """Contact of two parts: rods, cylinders and spheres, which count as round and end in half spheres.

    The first is sampled at its points (a cylinder at its `strips`), which must be closer than the second is thick.
    `stiffness` [N/m] and `damping` [N s/m] are those of the first part pressed on evenly along its whole length; both
    set in smoothly over `softness` [m]. What slips faster than `creep` [m/s] has passed `static_friction`, and feels
    `dynamic_friction`; what holds creeps slower than that. A part feels another at the joint it sits on too: leave
    room.
    """

    kind: Literal["contact"]
    stiffness: PositiveStiffness
    damping: Damping = 0.0
    softness: Length = 1e-4
    static_friction: NonNegativeNumber = 0.0
    dynamic_friction: NonNegativeNumber = 0.0
    creep: PositiveSpeed = 1e-3

    @model_validator(mode="after")
    def _sticks_at_least_as_it_slips(self) -> Self:
        if self.dynamic_friction > self.static_friction:
            raise wrong("dynamic_friction", "what slips has no more friction than what sticks, static_friction.")
        return self

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for a part that is not round."""
        for i, (name, part) in enumerate(zip(self.between, parts, strict=True)):
            if not isinstance(part, Rigid) or part.shape == "cylinder":
                continue
            if part.shape != "spheroid":
                why = f"{name} is a {part.shape}: contact is between rods, cylinders and spheres. Add a cylinder to it."
                raise wrong(f"between.{i}", why)
            assert part.length is not None and part.radius is not None
            if abs(part.length - 2 * part.radius) > 1e-6 * part.length:
                why = f"{name} is no sphere: a spheroid in contact needs a length of twice its radius."
                raise wrong(f"between.{i}", why)


def check_pair(own: str, pair: PairDescription, parts: Mapping[str, Limb]) -> None:
    """Raise the error of a pair called `own` that does not fit its parts."""
    here = f"pairs.{own}"
    if any(own in part.loads for part in parts.values()):
        raise wrong(here, f"a load is called {own} too, and results tell them apart by name. Choose another name.")
    for i, name in enumerate(pair.between):
        if name not in parts:
            raise wrong(f"{here}.between.{i}", f'there is no part "{name}".{did_you_mean(name, parts)}')
    first, second = pair.between
    if first == second:
        raise wrong(f"{here}.between", "a pair is of two parts, these are one.")
    with inside(here):
        pair.check((parts[first], parts[second]))

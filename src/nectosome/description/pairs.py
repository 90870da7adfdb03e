"""Pairs: what acts between two parts, neither of which need carry the other."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Name, Place, Position, Rotation
from nectosome.description.parts import Limb, Rigid, SoftPlate, has_place
from nectosome.io.schema.described import Described, inside, wrong
from nectosome.units import did_you_mean


class PairDescription(Described):
    """What acts between two parts."""

    kind: Any  # its name in a file, a literal of each class
    between: tuple[Name, Name]
    """Names of the two parts."""

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for parts that it does not act between."""


class BushingPair(PairDescription):
    """A stiff bushing that holds a place of one part to a place of another, as in a loop of bodies.

    The two are apart by the force over the stiffness.
    """

    kind: Literal["bushing"]
    at: tuple[Place, Place] = ("tip", "tip")
    """Where on each of the two parts: `tip`, `root` or a mark."""
    offset: tuple[Position, Position] = (ZERO, ZERO)
    """Distance from there, along the axes of each part."""
    rotation: Rotation = ZERO
    """Roll, pitch and yaw of the second place against the first, in a weld."""
    stiffness: fields.PositiveStiffness
    """Stiffness against the distance of the two places."""
    damping: fields.Damping = 0.0
    """Damping against the rate of that distance."""
    turning_stiffness: fields.AngularStiffness = 0.0
    """Stiffness against turning: without it the bushing is a ball joint, with it a weld."""
    turning_damping: fields.AngularDamping = 0.0
    """Damping against turning."""

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for a mark that a part does not have."""
        for i, (name, part, at) in enumerate(zip(self.between, parts, self.at, strict=True)):
            if not has_place(part, at):
                raise wrong(f"at.{i}", f"{name} has no mark at {at}. Write tip or root, or add the mark.")


class ContactPair(PairDescription):
    """Contact of two parts: rods, cylinders, capsules and spheres, which count as round and end in half spheres.

    The first is sampled at its points (a cylinder at its `strips`), which must be closer than the second is thick. A
    part feels another at the joint it sits on too: leave room.
    """

    kind: Literal["contact"]
    stiffness: fields.PositiveStiffness
    """Stiffness of the first part pressed on evenly along its whole length."""
    damping: fields.Damping = 0.0
    """Damping of the first part pressed on evenly along its whole length."""
    softness: fields.Length = 1e-4
    """Way into the contact over which both set in smoothly."""
    static_friction: fields.NonNegativeNumber = 0.0
    """Coefficient of friction of what sticks."""
    dynamic_friction: fields.NonNegativeNumber = 0.0
    """Coefficient of friction of what slips."""
    creep: fields.PositiveSpeed = 1e-3
    """Speed up to which what sticks creeps."""

    @model_validator(mode="after")
    def _sticks_at_least_as_it_slips(self) -> Self:
        if self.dynamic_friction > self.static_friction:
            raise wrong("dynamic_friction", "what slips has no more friction than what sticks, static_friction.")
        return self

    def check(self, parts: tuple[Limb, Limb]) -> None:
        """Raise the error of a field for a part that is not round."""
        for i, (name, part) in enumerate(zip(self.between, parts, strict=True)):
            why = part.own_shape.no_contact(part) if isinstance(part, Rigid) else ""
            if why:
                raise wrong(f"between.{i}", f"{name} {why}")


def check_pair(own: str, pair: PairDescription, parts: Mapping[str, Limb]) -> None:
    """Raise the error of a pair called `own` that does not fit its parts."""
    here = f"pairs.{own}"
    if any(own in part.loads for part in parts.values()):
        raise wrong(here, f"a load is called {own} too, and results tell them apart by name. Choose another name.")
    for i, name in enumerate(pair.between):
        if name not in parts:
            raise wrong(f"{here}.between.{i}", f'there is no part "{name}".{did_you_mean(name, parts)}')
        if isinstance(parts[name], SoftPlate):
            why = f"{name} is a soft plate, on which no pair acts. Name a rigid part or a rod."
            raise wrong(f"{here}.between.{i}", why)
    first, second = pair.between
    if first == second:
        raise wrong(f"{here}.between", "a pair is of two parts, these are one.")
    with inside(here):
        pair.check((parts[first], parts[second]))

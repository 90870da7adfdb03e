"""Loads: what the water, and anything else outside, does to a part."""

from typing import Annotated, Literal

from pydantic import Field

from nectosome.io.describe_base import ZERO, Described
from nectosome.io.describe_place import Place
from nectosome.io.fields import (
    Area,
    Force,
    LineForce,
    NonNegativeInertia,
    NonNegativeMass,
    NonNegativeNumber,
    Number,
    Torque,
)


class DragLoad(Described):
    """Quadratic drag and lift of a slender part, strip by strip: dimensionless coefficients."""

    kind: Literal["drag"]
    normal: NonNegativeNumber
    tangential: NonNegativeNumber = 0.0
    lift: Number = 0.0


class AddedMassLoad(Described):
    """Added mass of a slender part, strip by strip: dimensionless coefficients."""

    kind: Literal["added_mass"]
    normal: NonNegativeNumber
    tangential: NonNegativeNumber = 0.0


class LumpedDragLoad(Described):
    """Quadratic drag of a rigid part as a whole, along and about its own axes.

    `drag_area` is drag coefficient times area [m2] along x, y, z; `rotational` is c in the torque -c |w| w [kg m2].
    """

    kind: Literal["lumped_drag"]
    drag_area: tuple[Area, Area, Area]
    rotational: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO


class SpheroidAddedMassLoad(Described):
    """Added mass of a rigid spheroid, from its shape."""

    kind: Literal["spheroid_added_mass"]


class CylinderAddedMassLoad(Described):
    """Added mass of a rigid cylinder across its axis: `coefficient` times the displaced mass."""

    kind: Literal["cylinder_added_mass"]
    coefficient: NonNegativeNumber = 1.0


class GivenAddedMassLoad(Described):
    """Added mass [kg] and added inertia [kg m2] of a rigid part, given along and about its own axes."""

    kind: Literal["given_added_mass"]
    mass: tuple[NonNegativeMass, NonNegativeMass, NonNegativeMass]
    inertia: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO


class ForceLoad(Described):
    """A constant force [N] and moment [N m] at one place of a part, in the world's or the part's own frame."""

    kind: Literal["force"]
    force: tuple[Force, Force, Force]
    moment: tuple[Torque, Torque, Torque] = ZERO
    at: Place = "tip"
    frame: Literal["world", "body"] = "world"


class DistributedForceLoad(Described):
    """A constant force per length [N/m] along a part, in the world's or the part's own frame."""

    kind: Literal["distributed_force"]
    force: tuple[LineForce, LineForce, LineForce]
    frame: Literal["world", "body"] = "world"


Load = Annotated[
    DragLoad
    | AddedMassLoad
    | LumpedDragLoad
    | SpheroidAddedMassLoad
    | CylinderAddedMassLoad
    | GivenAddedMassLoad
    | ForceLoad
    | DistributedForceLoad,
    Field(discriminator="kind"),
]

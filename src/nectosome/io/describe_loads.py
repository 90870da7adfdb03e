"""Loads: what the water, and anything else outside, does to a part."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from nectosome.io.describe_base import ZERO, Described, wrong
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


class PlateDragLoad(Described):
    """Blade-element drag of a plate or bar, face by face, strip by strip: `normal` is dimensionless."""

    kind: Literal["plate_drag"]
    normal: NonNegativeNumber


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


_Row = tuple[Number, Number, Number, Number, Number, Number]


class GivenAddedMassLoad(Described):
    """Added mass of a rigid part about the centre of its shape, along and about its own axes.

    Either `mass` [kg] and `inertia` [kg m2] axis by axis, or the full `matrix`: six rows of six plain numbers in SI
    units, rotation before translation, symmetric and without negative eigenvalues.
    """

    kind: Literal["given_added_mass"]
    mass: tuple[NonNegativeMass, NonNegativeMass, NonNegativeMass] | None = None
    inertia: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO
    matrix: tuple[_Row, _Row, _Row, _Row, _Row, _Row] | None = None

    @model_validator(mode="after")
    def _is_an_inertia(self) -> Self:
        if (self.mass is None) == (self.matrix is None):
            raise wrong("mass", "give either a mass for each axis or the full matrix, one of the two.")
        if self.matrix is None:
            return self
        if self.inertia != ZERO:
            raise wrong("inertia", "the matrix says it already. Leave it out.")
        import numpy as np

        matrix = np.array(self.matrix)
        slack = 1e-9 * max(np.abs(matrix).max(), 1e-300)
        if np.abs(matrix - matrix.T).max() > slack:
            raise wrong("matrix", "an added-mass matrix is symmetric, this one is not.")
        if np.linalg.eigvalsh(matrix).min() < -slack:
            raise wrong(
                "matrix", "an added mass takes energy in every direction, this matrix gives some: it is not valid."
            )
        return self


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
    | PlateDragLoad
    | AddedMassLoad
    | LumpedDragLoad
    | SpheroidAddedMassLoad
    | CylinderAddedMassLoad
    | GivenAddedMassLoad
    | ForceLoad
    | DistributedForceLoad,
    Field(discriminator="kind"),
]

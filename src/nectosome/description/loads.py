"""Loads: what the water, and anything else outside, does to a part."""

import math
from collections.abc import Collection
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nectosome.description.base import ZERO, Axis, Place, Position
from nectosome.description.fields import (
    Angle,
    AngularSpeed,
    Area,
    Coordinate,
    Current,
    Damping,
    Elastance,
    Force,
    Fraction,
    Length,
    LineForce,
    NonNegativeInertia,
    NonNegativeMass,
    NonNegativeNumber,
    Number,
    PositiveAngularSpeed,
    PositiveArea,
    PositiveInertia,
    PositiveNumber,
    PositiveSpeed,
    PositiveStiffness,
    PositiveTorque,
    QuadraticDrag,
    Torque,
    Volume,
)
from nectosome.description.mirror import Mirror, Mirrored, about, along, opposite
from nectosome.description.signals import AngleSignal
from nectosome.io.schema.described import Described, wrong

RIGID = ("cylinder", "box", "spheroid", "point")
"""Shapes of rigid parts."""
ROD = ("rod",)


class LoadDescription(Mirrored):
    """What acts on a part. `on` are the shapes of part that it acts on, among them "rod".

    One that acts `per_length` is worked out strip by strip along a part.
    """

    kind: Any  # its name in a file, a literal of each class
    on: ClassVar[tuple[str, ...]] = (*RIGID, *ROD)
    per_length: ClassVar[bool] = False

    def image(self) -> Self:
        """Return the image; what is in the world's frame stays as it is."""
        return self if getattr(self, "frame", None) == "world" else super().image()

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a part that it does not act on: its shape, its marks, its free strains."""
        if shape not in self.on:
            rigid = tuple(name for name in self.on if name in RIGID)
            if shape == "rod":
                why = "acts on rigid parts, not on a rod."
            elif not rigid:
                why = "acts on a rod, not on a rigid part."
            else:
                why = f"acts on {listed(rigid, 'or')}, not on a {shape}."
            raise wrong("kind", f"{self.kind} {why}")


def listed(names: tuple[str, ...], last: str = "and") -> str:
    """Return names as a row in a sentence: `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"


class DragLoad(LoadDescription):
    """Quadratic drag and lift of a slender part, strip by strip: dimensionless coefficients."""

    kind: Literal["drag"]
    normal: NonNegativeNumber
    tangential: NonNegativeNumber = 0.0
    lift: Number = 0.0
    on = ("cylinder", "rod")
    per_length = True
    mirror = Mirror(lift=opposite)


class PlateDragLoad(LoadDescription):
    """Blade-element drag of a plate or bar, face by face, strip by strip: `normal` is dimensionless."""

    kind: Literal["plate_drag"]
    normal: NonNegativeNumber
    on = ("box", "rod")
    per_length = True
    mirror = Mirror()


class AddedMassLoad(LoadDescription):
    """Added mass of a slender part, strip by strip: dimensionless coefficients."""

    kind: Literal["added_mass"]
    normal: NonNegativeNumber
    tangential: NonNegativeNumber = 0.0
    on = ("cylinder", "box", "rod")
    per_length = True
    mirror = Mirror()


class LumpedDragLoad(LoadDescription):
    """Quadratic drag of a rigid part as a whole, along and about its own axes.

    `drag_area` is drag coefficient times area [m2] along x, y, z; `rotational` is c in the torque -c |w| w [kg m2].
    """

    kind: Literal["lumped_drag"]
    drag_area: tuple[Area, Area, Area]
    rotational: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO
    on = RIGID
    mirror = Mirror()


class SpheroidAddedMassLoad(LoadDescription):
    """Added mass of a rigid spheroid, from its shape."""

    kind: Literal["spheroid_added_mass"]
    on = ("spheroid",)
    mirror = Mirror()


class CylinderAddedMassLoad(LoadDescription):
    """Added mass of a rigid cylinder across its axis: `coefficient` times the displaced mass."""

    kind: Literal["cylinder_added_mass"]
    coefficient: NonNegativeNumber = 1.0
    on = ("cylinder",)
    mirror = Mirror()


_Row = tuple[Number, Number, Number, Number, Number, Number]


def _matrix_image(rows: Any) -> Any:
    """Image of a 6 x 6 matrix, rotation before translation."""
    signs = (-1, 1, -1, 1, -1, 1)
    return tuple(
        tuple(a * b * x + 0.0 for b, x in zip(signs, row, strict=True)) for a, row in zip(signs, rows, strict=True)
    )


class GivenAddedMassLoad(LoadDescription):
    """Added mass of a rigid part about the centre of its shape, along and about its own axes.

    Either `mass` [kg] and `inertia` [kg m2] axis by axis, or the full `matrix`: six rows of six plain numbers in SI
    units, rotation before translation, symmetric and without negative eigenvalues.
    """

    kind: Literal["given_added_mass"]
    mass: tuple[NonNegativeMass, NonNegativeMass, NonNegativeMass] | None = None
    inertia: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO
    matrix: tuple[_Row, _Row, _Row, _Row, _Row, _Row] | None = None
    on = RIGID
    mirror = Mirror(matrix=_matrix_image)

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


class CrankMotor(Described):
    """A DC motor with its gear, as the crank feels it: from `stall_torque` [N m] at rest to none at `no_load_speed`.

    The current goes with the torque, up to `stall_current` [A]; `inertia` [kg m2] is that of crank, gear and rotor.
    The crank starts at `angle` [rad] with `speed` [rad/s].
    """

    stall_torque: PositiveTorque
    no_load_speed: PositiveAngularSpeed
    inertia: PositiveInertia
    stall_current: Current = 0.0
    angle: Angle = 0.0
    speed: AngularSpeed = 0.0
    cycle_angle = "angle"


class JetLoad(LoadDescription):
    """A pulsed jet of a rigid part: a chamber that a crank empties through a nozzle and that fills again.

    `volume` [m3] of the chamber at angles evenly spread over a turn, at least four, the first at angle 0: a smooth
    periodic curve. Water leaves through `nozzle` [m2] and comes in through `inlet` [m2], nozzle and valves together,
    narrowed by the contraction of the flow. The thrust is along `direction` in the part's own frame; the chamber sits
    at `place` [m] from the centre of the part's shape. `bell` is the added mass of the bell along the direction, in
    masses of the water in its chamber (that water comes on top): both change with the volume, so leave them out of
    other added masses. Water that comes in has the share `wake` of the body's velocity already: 0 in still water, 1 in
    a wake that moves along with the body. The crank either follows `crank` [rad] or is turned by a `motor`, against the
    water and against a shell of `elastance` [Pa/m3] that is at ease at the largest of the volumes.
    """

    kind: Literal["jet"]
    volume: Annotated[tuple[Volume, ...], Field(min_length=4)]
    nozzle: PositiveArea
    inlet: PositiveArea
    bell: NonNegativeNumber = 0.0
    wake: Fraction = 0.0
    elastance: Elastance = 0.0
    direction: Axis = (1.0, 0.0, 0.0)
    place: Position = ZERO
    crank: AngleSignal | None = None
    motor: CrankMotor | None = None
    on = RIGID
    mirror = Mirror(direction=along, place=along)

    @model_validator(mode="after")
    def _is_turned_once(self) -> Self:
        if self.crank is None and self.motor is None:
            raise wrong("crank", "is missing. Say how the crank turns, or give a motor.")
        if self.crank is not None and self.motor is not None:
            raise wrong("motor", "the crank's angle is given already. Leave one of the two out.")
        return self


class ForceLoad(LoadDescription):
    """A constant force [N] and moment [N m] at one place of a part, in the world's or the part's own frame."""

    kind: Literal["force"]
    force: tuple[Force, Force, Force]
    moment: tuple[Torque, Torque, Torque] = ZERO
    at: Place = "tip"
    frame: Literal["world", "body"] = "world"
    mirror = Mirror(force=along, moment=about)

    def check(self, shape: str, marks: tuple[float, ...] = (), strains: Collection[str] = ()) -> None:
        """Raise the error of a field for a place that the part does not have."""
        if not isinstance(self.at, str) and self.at not in marks:
            why = f"the rod has no mark at {self.at}. Add it to its marks."
            raise wrong("at", why if shape == "rod" else "only a rod has marks. Write tip or root.")


class LegLoad(LoadDescription):
    """A leg on a rigid part, in the part's x-z plane: a crank pulls it through a bearing, its foot steps on the floor.

    The `crank` [m] turns about `hip` [m, in the part's frame] at `speed` [rad/s] from the angle `start` [rad], forward
    from ahead over the top; `bearing` [m] is the place of the bearing from there, along x and z; `length` [m] goes from
    the crank's pin to the foot. The leg is a spring of `stiffness` [N/m] and a damper, `damping_ratio` of the critical
    one with the part's mass; `static_friction` and `dynamic_friction` are those of the floor, on which all damping
    sets in over `softness` [m]. It only pushes, unless it `pulls`. `tangential` and `normal` [kg/m] times the squared
    speed is the drag of its foot along and across the leg. It stands for `count` legs side by side.
    """

    kind: Literal["leg"]
    hip: Position
    crank: Length
    bearing: tuple[Coordinate, Coordinate]
    length: Length
    speed: AngularSpeed
    start: Angle = 0.0
    stiffness: PositiveStiffness
    damping_ratio: PositiveNumber
    static_friction: NonNegativeNumber
    dynamic_friction: NonNegativeNumber
    softness: Length = 1e-3
    pulls: bool = False
    tangential: QuadraticDrag = 0.0
    normal: QuadraticDrag = 0.0
    count: PositiveNumber = 1.0
    on = RIGID
    mirror = Mirror(hip=along)
    cycle_angle = "start"

    @model_validator(mode="after")
    def _slides_through_its_bearing(self) -> Self:
        if not self.crank < math.hypot(*self.bearing):
            raise wrong("bearing", "the crank reaches its bearing: it must be further away than the crank is long.")
        return self


class DistributedForceLoad(LoadDescription):
    """A constant force per length [N/m] along a part, in the world's or the part's own frame."""

    kind: Literal["distributed_force"]
    force: tuple[LineForce, LineForce, LineForce]
    frame: Literal["world", "body"] = "world"
    on = ("cylinder", "box", "spheroid", "rod")
    per_length = True
    mirror = Mirror(force=along)


class NearFloorLoad(LoadDescription):
    """Added mass and drag that a rigid part has near the floor, on top of what it has everywhere.

    `mass` [kg], `drag_area` [m2] and `rotational` [kg m2] are along and about its own axes, as in `given_added_mass`
    and `lumped_drag`. All of it is there where the part's centre is up to `full` [m] over the floor, nothing from
    `none` [m] on, and in between it goes over smoothly.
    """

    kind: Literal["near_floor"]
    mass: tuple[NonNegativeMass, NonNegativeMass, NonNegativeMass] = ZERO
    drag_area: tuple[Area, Area, Area] = ZERO
    rotational: tuple[NonNegativeInertia, NonNegativeInertia, NonNegativeInertia] = ZERO
    full: Coordinate
    none: Coordinate
    on = RIGID
    mirror = Mirror()

    @model_validator(mode="after")
    def _goes_over(self) -> Self:
        if not self.full < self.none:
            raise wrong("none", "must be higher than full.")
        return self


class PulsedThrustLoad(LoadDescription):
    """Thrust of a jet as it was measured over a turn of its crank, on a robot that was held.

    `values` [N], at least four, are evenly spread over a turn, the first at angle 0: a smooth periodic curve. They were
    measured at the speed `rated` [rad/s]; at another `speed` [rad/s] the thrust goes with its square. The crank starts
    at `start` [rad]. The force is along `direction` in the part's own frame, at `place` [m] from the centre of its
    shape.
    """

    kind: Literal["pulsed_thrust"]
    values: Annotated[tuple[Force, ...], Field(min_length=4)]
    rated: PositiveAngularSpeed
    speed: AngularSpeed
    start: Angle = 0.0
    direction: Axis = (1.0, 0.0, 0.0)
    place: Position = ZERO
    on = RIGID
    mirror = Mirror(direction=along, place=along)
    cycle_angle = "start"


class WallContactLoad(LoadDescription):
    """The soft hull of a rigid part, which the walls of the tank push back: a spring and a damper that only push.

    The hull ends at `reach` [m] ahead of and behind the part's centre, along the world's x. `stiffness` [N/m] and
    `damping` [N s/m] are those of either end; the damper sets in over `softness` [m].
    """

    kind: Literal["wall_contact"]
    reach: Length
    stiffness: PositiveStiffness
    damping: Damping = 0.0
    softness: Length = 1e-3
    on = RIGID
    mirror = Mirror()


class TrailingEdgeLoad(LoadDescription):
    """What is shed into the wake at the tip of a rod that runs from head to tail, beside its strips of added mass.

    `normal` is their coefficient; where the tip goes through the water tail first at less than about `softness` [m/s],
    it fades away.
    """

    kind: Literal["trailing_edge"]
    normal: NonNegativeNumber = 1.0
    softness: PositiveSpeed = 0.01
    on = ROD
    mirror = Mirror()

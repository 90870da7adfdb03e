"""Loads that a crank turns: jets, legs, the thrust of a jet as it was measured."""

import math
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from nectosome.description import fields
from nectosome.description.fields import ZERO, Axis, Name, Position
from nectosome.description.loads import RIGID, LoadDescription
from nectosome.description.mirror import Mirror, along
from nectosome.description.ranges import SHAKEN, THRUST
from nectosome.description.signals import AngleSignal
from nectosome.io.schema.described import Uncertainty, wrong


class CrankLoad(LoadDescription):
    """What loads with a crank share. `turns` is the field that says how it turns where no part turns it."""

    turns: ClassVar[tuple[str, str, str]]  # its name, "how" it turns in words, and what it gives
    turned_by: Name | None = None
    """Part on a revolute joint that turns the crank by its angle, and feels the torque of the load. Its motor or servo
    then drives the crank."""

    @model_validator(mode="after")
    def _is_turned_once(self) -> Self:
        field, how, what = self.turns
        if getattr(self, field) is None and self.turned_by is None:
            raise wrong(field, f"is missing. Say {how} the crank turns, or name a part that turns it in turned_by.")
        if getattr(self, field) is not None and self.turned_by is not None:
            raise wrong("turned_by", f"the crank's {what} is given already. Leave one of the two out.")
        return self


class JetLoad(CrankLoad):
    """A pulsed jet of a rigid part: a chamber that a crank empties through a nozzle and that fills again."""

    kind: Literal["jet"]
    volume: Annotated[tuple[fields.Volume, ...], Field(min_length=4)]
    """Volume of the chamber at angles of the crank evenly spread over a turn, the first at angle 0: a smooth periodic
    curve."""
    nozzle: fields.PositiveArea
    """Area of the nozzle through which water leaves, narrowed by the contraction of the flow."""
    inlet: fields.PositiveArea
    """Area through which water comes in, nozzle and valves together, narrowed by the contraction of the flow."""
    bell: fields.NonNegativeNumber = 0.0
    """Added mass of the bell along the direction, in masses of the water in its chamber; that water comes on top. Both
    change with the volume, so leave them out of other added masses."""
    wake: fields.Fraction = 0.0
    """Share of the body's velocity that water coming in has already: 0 in still water, 1 in a wake that moves along
    with the body."""
    elastance: fields.Elastance = 0.0
    """Elastance of the shell, which is at ease at the largest of the volumes."""
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction of the thrust. Direction in the part's own frame: x, y, z or three numbers."""
    place: Position = ZERO
    """Place of the chamber. Place from the centre of the part's shape."""
    crank: AngleSignal | None = None
    """Angle of the crank over time, instead of a part that turns it."""
    turns = "crank", "how", "angle"
    on = RIGID
    mirror = Mirror(direction=along, place=along)
    spreads: ClassVar = {
        "nozzle": Uncertainty(0.9, 1.1, "contraction of the flow, chosen", THRUST),
        "inlet": Uncertainty(0.8, 1.2, "contraction of the flow, chosen", "measure the pressure as it refills"),
        "bell": Uncertainty(0.7, 1.4, "chosen", SHAKEN),
    }

    @model_validator(mode="before")
    @classmethod
    def _without_a_motor(cls, given: Any) -> Any:
        if isinstance(given, dict) and "motor" in given:
            why = "a crank has no motor of its own. Give a part a revolute joint with a motor and name it in turned_by."
            raise wrong("motor", why)
        return given


class LegLoad(CrankLoad):
    """A leg in the x-z plane of a rigid part: a crank pulls it through a bearing, its foot steps on the floor."""

    kind: Literal["leg"]
    hip: Position
    """Place of the crank's axis, in the part's frame."""
    crank: fields.Length
    """Length of the crank."""
    bearing: tuple[fields.Coordinate, fields.Coordinate]
    """Place of the bearing from the hip, along x and z."""
    length: fields.Length
    """Length from the crank's pin to the foot."""
    speed: fields.AngularSpeed | None = None
    """Speed of the crank, instead of a part that turns it; forward is from ahead over the top."""
    start: fields.Angle = 0.0
    """Angle of the crank at the start; of one that a part turns, at the angle 0 of its joint."""
    stiffness: fields.PositiveStiffness
    """Stiffness of the leg, a spring."""
    damping_ratio: fields.PositiveNumber
    """Damping of the leg, as a share of the critical one with the part's mass."""
    static_friction: fields.NonNegativeNumber
    """Coefficient of friction of the floor for a foot that sticks."""
    dynamic_friction: fields.NonNegativeNumber
    """Coefficient of friction of the floor for a foot that slips."""
    softness: fields.Length = 1e-3
    """Way into the floor over which all damping sets in."""
    pulls: bool = False
    """Whether the leg pulls too, instead of pushing only."""
    tangential: fields.QuadraticDrag = 0.0
    """Drag of the foot along the leg, over the squared speed."""
    normal: fields.QuadraticDrag = 0.0
    """Drag of the foot across the leg, over the squared speed."""
    count: fields.PositiveNumber = 1.0
    """Number of legs side by side that this one stands for."""
    turns = "speed", "how fast", "speed"
    on = RIGID
    mirror = Mirror(hip=along)
    spreads: ClassVar = {
        name: Uncertainty(0.7, 1.3, "wet rubber, chosen", "pull it over the floor")
        for name in ("static_friction", "dynamic_friction")
    }
    cycle_angle = "start"

    @model_validator(mode="after")
    def _slides_through_its_bearing(self) -> Self:
        if not self.crank < math.hypot(*self.bearing):
            raise wrong("bearing", "the crank reaches its bearing: it must be further away than the crank is long.")
        return self


class PulsedThrustLoad(LoadDescription):
    """Thrust of a jet as it was measured over a turn of its crank, on a robot that was held."""

    kind: Literal["pulsed_thrust"]
    values: Annotated[tuple[fields.Force, ...], Field(min_length=4)]
    """Thrust at angles of the crank evenly spread over a turn, the first at angle 0: a smooth periodic curve."""
    rated: fields.PositiveAngularSpeed
    """Speed of the crank at which it was measured."""
    speed: fields.AngularSpeed
    """Speed of the crank; the thrust goes with its square."""
    start: fields.Angle = 0.0
    """Angle of the crank at the start."""
    direction: Axis = (1.0, 0.0, 0.0)
    """Direction of the thrust. Direction in the part's own frame: x, y, z or three numbers."""
    place: Position = ZERO
    """Place of the thrust. Place from the centre of the part's shape."""
    on = RIGID
    mirror = Mirror(direction=along, place=along)
    cycle_angle = "start"

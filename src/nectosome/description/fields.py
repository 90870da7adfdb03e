"""What robot files have in many places: quantities with dimension and range; names, vectors, axes and places."""

import math
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from nectosome.io.schema.described import Shorthand, unfit
from nectosome.io.schema.quantity import Quantity
from nectosome.units import shorten


def _positive(dimension: str) -> Quantity:
    return Quantity(dimension, minimum=0, exclusive=True)


Number = Annotated[float, Quantity("number")]
NonNegativeNumber = Annotated[float, Quantity("number", minimum=0)]
PositiveNumber = Annotated[float, _positive("number")]
Fraction = Annotated[float, Quantity("number", minimum=0, maximum=1)]
Share = Annotated[float, Quantity("number", minimum=0.05, maximum=0.95)]
Poisson = Annotated[float, Quantity("number", minimum=0, maximum=0.5)]
Length = Annotated[float, _positive("length")]
FixedLength = Annotated[float, Quantity("length", minimum=0, exclusive=True, fixed=True)]
Coordinate = Annotated[float, Quantity("length")]
Area = Annotated[float, Quantity("area", minimum=0)]
PositiveArea = Annotated[float, _positive("area")]
Volume = Annotated[float, Quantity("volume", minimum=0)]
NonNegativeMass = Annotated[float, Quantity("mass", minimum=0)]
Density = Annotated[float, _positive("density")]
ProductOfInertia = Annotated[float, Quantity("inertia")]
NonNegativeInertia = Annotated[float, Quantity("inertia", minimum=0)]
Pressure = Annotated[float, _positive("pressure")]
NonNegativePressure = Annotated[float, Quantity("pressure", minimum=0)]
AnyPressure = Annotated[float, Quantity("pressure")]
Elastance = Annotated[float, Quantity("elastance", minimum=0)]
Viscosity = Annotated[float, Quantity("viscosity", minimum=0)]
PositiveViscosity = Annotated[float, _positive("viscosity")]
Angle = Annotated[float, Quantity("angle")]
Bend = Annotated[float, Quantity("angle", minimum=-2 * math.pi, maximum=2 * math.pi)]
Curvature = Annotated[float, Quantity("curvature")]
CurvatureRate = Annotated[float, Quantity("curvature_rate")]
StrainRate = Annotated[float, Quantity("strain_rate")]
Time = Annotated[float, Quantity("time")]
Duration = Annotated[float, Quantity("time", minimum=0)]
PositiveTime = Annotated[float, _positive("time")]
Frequency = Annotated[float, Quantity("frequency", minimum=0)]
PositiveFrequency = Annotated[float, _positive("frequency")]
FixedFrequency = Annotated[float, Quantity("frequency", minimum=0, exclusive=True, fixed=True)]
AngularSpeed = Annotated[float, Quantity("angular_speed")]
Speed = Annotated[float, Quantity("speed")]
PositiveSpeed = Annotated[float, _positive("speed")]
Gravity = Annotated[float, Quantity("acceleration", minimum=0)]
Force = Annotated[float, Quantity("force")]
Tension = Annotated[float, Quantity("force", minimum=0)]
NonNegativeForce = Annotated[float, Quantity("force", minimum=0)]
Torque = Annotated[float, Quantity("torque")]
LineForce = Annotated[float, Quantity("line_force")]
AngularStiffness = Annotated[float, Quantity("angular_stiffness", minimum=0)]
PositiveAngularStiffness = Annotated[float, _positive("angular_stiffness")]
PositiveTorque = Annotated[float, _positive("torque")]
PositiveAngularSpeed = Annotated[float, _positive("angular_speed")]
PositiveAngle = Annotated[float, _positive("angle")]
NonNegativeAngle = Annotated[float, Quantity("angle", minimum=0)]
NonNegativeLength = Annotated[float, Quantity("length", minimum=0)]
NonNegativeTorque = Annotated[float, Quantity("torque", minimum=0)]
NonNegativeCurrent = Annotated[float, Quantity("current", minimum=0)]
PositiveCurrent = Annotated[float, _positive("current")]
Voltage = Annotated[float, Quantity("voltage")]
PositiveVoltage = Annotated[float, _positive("voltage")]
Resistance = Annotated[float, Quantity("resistance", minimum=0)]
PositiveResistance = Annotated[float, _positive("resistance")]
PositiveTorqueConstant = Annotated[float, _positive("torque_constant")]
DeadBand = Annotated[float, Quantity("number", minimum=0, maximum=0.9)]
PositiveShare = Annotated[float, Quantity("number", minimum=0, maximum=1, exclusive=True)]
Energy = Annotated[float, _positive("energy")]
Charge = Annotated[float, _positive("charge")]
PowerUsed = Annotated[float, Quantity("power", minimum=0)]
AngularDamping = Annotated[float, Quantity("angular_damping", minimum=0)]
Stiffness = Annotated[float, Quantity("stiffness", minimum=0)]
PositiveStiffness = Annotated[float, _positive("stiffness")]
QuadraticDrag = Annotated[float, Quantity("quadratic_drag", minimum=0)]
Damping = Annotated[float, Quantity("damping", minimum=0)]


Name = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_]*$", max_length=60)]
"""A name people choose: small letters, digits and underscores, a letter first."""

AliasName = Annotated[str, Field(pattern=r"^[A-Za-z][A-Za-z0-9_]*$", max_length=60)]
"""A short name for a quantity; capitals are allowed, since people write E and L."""

Vector = tuple[Number, Number, Number]
Position = tuple[Coordinate, Coordinate, Coordinate]
Rotation = tuple[Angle, Angle, Angle]
Velocity = tuple[Speed, Speed, Speed]
AngularVelocity = tuple[AngularSpeed, AngularSpeed, AngularSpeed]

ZERO = (0.0, 0.0, 0.0)

AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}

Direction = Literal["x", "-x", "y", "-y", "z", "-z"]
"""An axis, and which way along it."""

DIRECTIONS: dict[str, tuple[float, float, float]] = {
    "x": (1.0, 0.0, 0.0),
    "-x": (-1.0, 0.0, 0.0),
    "y": (0.0, 1.0, 0.0),
    "-y": (0.0, -1.0, 0.0),
    "z": (0.0, 0.0, 1.0),
    "-z": (0.0, 0.0, -1.0),
}


class NamedAxis(Shorthand):
    """A direction that may be written as x, y or z."""

    def expand(self, value: Any) -> Any:
        """Turn the name of an axis into a unit vector."""
        if isinstance(value, str):
            if value not in AXES:
                raise unfit(f'"{shorten(value)}" is no axis. Write x, y, z or three numbers.')
            return AXES[value]
        return value

    def shorten(self, row: list[Any]) -> Any:
        """Turn a unit vector into the name of its axis."""
        return next((name for name, axis in AXES.items() if list(axis) == row), row)

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of the names."""
        return {"enum": list(AXES)}


def _not_zero(axis: tuple[float, ...]) -> tuple[float, ...]:
    if not any(axis):
        raise unfit("the axis has no length. Write x, y, z or three numbers.")
    return axis


Axis = Annotated[Vector, AfterValidator(_not_zero), NamedAxis()]
"""A direction, of any length but 0."""


def _read_place(value: Any) -> str | float:
    if isinstance(value, str) and value in ("tip", "root"):
        return value
    if isinstance(value, int | float) and not isinstance(value, bool) and 0 < value < 1:
        return float(value)
    why = f'"{shorten(value)}" is no place on a part. Write tip, root, or the fraction of one of the rod\'s marks.'
    raise unfit(why)


_FRACTION = {"type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1}
_PLACE = {"description": "tip, root, or one of the rod's marks", "anyOf": [{"enum": ["tip", "root"]}, _FRACTION]}
Place = Annotated[str | float, PlainValidator(_read_place), WithJsonSchema(_PLACE)]
"""`tip`, `root`, or the fraction (0 to 1) of one of a rod's marks."""


def listed(names: tuple[str, ...], last: str = "and") -> str:
    """Return names as a row in a sentence: `a, b and c`."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} {last} {names[-1]}"


class WordAuto(Shorthand):
    """The word auto, or the group {auto: true}."""

    def expand(self, value: Any) -> Any:
        """Take the group for the word."""
        return "auto" if value == {"auto": True} else value

    def shorten(self, row: Any) -> Any:
        """Leave the word."""
        return row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of the group."""
        return {"type": "object", "properties": {"auto": {"const": True}}, "required": ["auto"]}

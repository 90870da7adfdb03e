"""Names, vectors, axes and places, as robot files have them."""

from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Field, PlainValidator, WithJsonSchema

from nectosome.description.fields import Angle, AngularSpeed, Coordinate, Number, Speed
from nectosome.io.schema.described import Shorthand, unfit
from nectosome.units import shorten

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

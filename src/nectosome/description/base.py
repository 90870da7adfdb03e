"""What all descriptions share: frozen models, choices by kind, names, vectors, places, and errors of one field."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    WithJsonSchema,
)
from pydantic_core import PydanticCustomError, core_schema

from nectosome.description.fields import Angle, AngularSpeed, Coordinate, Number, Speed
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


class Described(BaseModel):
    """A frozen part of a description; its quantities are SI floats, and unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    cycle_angle: ClassVar[str | None] = None  # the field with the angle [rad] of its cycle at time 0


def wrong(field: str, why: str) -> PydanticCustomError:
    """Return the error to raise in a model's validator for a mistake that belongs to `field`."""
    return PydanticCustomError("field", "{why}", {"field": field, "why": why})


def unfit(why: str) -> PydanticCustomError:
    """Return the error to raise in a field's validator."""
    return PydanticCustomError("unfit", "{why}", {"why": why})


@contextmanager
def inside(group: str) -> Iterator[None]:
    """Name fields in errors from the group around this one: `at` becomes `loads.push.at`."""
    try:
        yield
    except PydanticCustomError as error:
        field = (error.context or {}).get("field")
        raise wrong(f"{group}.{field}" if field else group, error.message()) from None


def increasing(why: str, key: Callable[[Any], float] = float) -> AfterValidator:
    """Return the validator of a row whose items increase by `key`; its error says `why`."""

    def check(row: tuple[Any, ...]) -> tuple[Any, ...]:
        if any(key(after) <= key(before) for before, after in pairwise(row)):
            raise unfit(why)
        return row

    return AfterValidator(check)


def kinds_of(base: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Return the classes below `base` that have a kind of their own, by kind, in the order of their definition."""
    found: dict[str, type[BaseModel]] = {}
    for cls in base.__subclasses__():
        own = cls.model_fields["kind"].annotation
        found |= {get_args(own)[0]: cls} if get_origin(own) is Literal else kinds_of(cls)
    return found


@dataclass(frozen=True)
class OneOf:
    """Marks a base class in a field: each of its kinds is known there; messages name those that are `fitting`."""

    fitting: Callable[[Any], bool] = lambda _: True

    def union(self, base: type[BaseModel]) -> Any:
        """Return the union of all kinds of `base`."""
        return Union[tuple(kinds_of(base).values())]  # noqa: UP007  known when this is run only

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return handler.generate_schema(Annotated[self.union(source), Field(discriminator="kind")])


class Shorthand(ABC):
    """Marks a tuple that has a short form in a file."""

    @abstractmethod
    def expand(self, value: Any) -> Any:
        """Return the full form of a value in either form."""

    @abstractmethod
    def shorten(self, row: list[Any]) -> Any:
        """Return the short form of `row`, or `row` itself if it has none."""

    @abstractmethod
    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the JSON schema of the short form; `row` is that of the full one."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self.expand, handler(source))

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        row = handler(schema)
        return {"anyOf": [self.json_schema(row), row]}


class OneOrMany(Shorthand):
    """A row that may be written as its only item."""

    def expand(self, value: Any) -> Any:
        """Put a single item into a row."""
        return value if isinstance(value, list | tuple) else (value,)

    def shorten(self, row: list[Any]) -> Any:
        """Take a single item out of its row."""
        return row[0] if len(row) == 1 else row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of one item."""
        return row["items"]


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

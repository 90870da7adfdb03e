"""What all models of files share: frozen models, choices by kind, short forms, and errors of one field."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal, NamedTuple, Union, get_args, get_origin

from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
)
from pydantic_core import PydanticCustomError, core_schema

from nectosome.io.discovery import classes_below

Text = Annotated[str, BeforeValidator(lambda value: str(value) if type(value) in (int, float) else value)]
"""A text, which may be a number in a file."""


class Uncertainty(NamedTuple):
    """How far a number may be off where its file does not say: its true value lies between with 95 %."""

    low: float  # as a factor on the number, or the value itself [SI] where `absolute`
    high: float
    source: str
    experiment: str  # what tells it better
    absolute: bool = False
    law: float = 0.0  # by how much its law is off, however well it is measured: as the logarithm of a factor


class Described(BaseModel):
    """A frozen part of a description; its quantities are SI floats, and unknown fields are refused."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    described_in: ClassVar[type | None] = None  # the dataclass that a model was made of
    cycle_angle: ClassVar[str | None] = None  # the field with the angle [rad] of its cycle at time 0
    decided_by: ClassVar[dict[str, str]] = {}  # paths below, each with what decides it where that is given
    spreads: ClassVar[dict[str, Uncertainty]] = {}  # of fields whose numbers nobody knows well

    @property
    def beside_defaults(self) -> frozenset[str]:
        """Fields that something else than their default stands for where they are left out."""
        return frozenset()

    @property
    def decided(self) -> dict[str, str]:
        """Paths below whose numbers have no effect, each with the path below of what decides it."""
        given = self.decided_by.items()
        return {path: by for path, by in given if getattr(self, by.partition(".")[0], None) is not None}


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
    kinds: dict[str, type[BaseModel]] = {}
    for cls in base.__subclasses__():
        own = cls.model_fields["kind"].annotation
        kinds |= {get_args(own)[0]: cls} if get_origin(own) is Literal else kinds_of(cls)
    return kinds


@dataclass(frozen=True)
class OneOf:
    """Marks a base class in a field: each of its kinds is known there; messages name those that are `fitting`.

    A group without a kind is of the kind `default`, where there is one.
    """

    fitting: Callable[[Any], bool] = lambda _: True
    default: str | None = None

    def kinds(self, base: type[BaseModel]) -> dict[str, type[BaseModel]]:
        """Return the kinds of `base`."""
        return kinds_of(base)

    def kind_of(self, value: Any) -> Any:
        """Return the kind of a group of fields, or of a model of one; the default of what says none."""
        given = value.get("kind") if isinstance(value, dict) else getattr(value, "kind", None)
        return self.default if given is None else given

    def union(self, base: type[BaseModel]) -> Any:
        """Return the union of all kinds of `base`."""
        return Union[tuple(self.kinds(base).values())]  # noqa: UP007  known when this is run only

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        kinds = self.kinds(source)
        if self.default is None:
            schema = handler.generate_schema(Annotated[self.union(source), Field(discriminator="kind")])
        else:
            choices = {kind: handler.generate_schema(cls) for kind, cls in kinds.items()}
            schema = core_schema.tagged_union_schema(choices, discriminator=self.kind_of)
        fitting = [kind for kind, cls in kinds.items() if self.fitting(cls)]
        mark = {"fitting": fitting, "default": self.default}
        return schema | {"metadata": {**schema.get("metadata", {}), **mark}}  # pyright: ignore


def _base(hint: Any) -> type[BaseModel]:
    return next(member for member in get_args(hint) if isinstance(member, type) and issubclass(member, BaseModel))


@dataclass(frozen=True)
class NameOrGroup:
    """Marks `str | Base`: a class below Base is written as its `form` where it has no fields, else as its fields.

    A group is of the model to which most of its fields belong, also where they are misspelt. `also` says in messages
    what a group looks like.
    """

    also: str

    def union(self, hint: Any) -> Any:
        """Return the choice of `Literal["a", "b"] | Model` for all classes below the base in a hint."""
        names = tuple(cls.form for cls in self.named(hint))
        groups = tuple(cls for cls in classes_below(_base(hint)) if cls.model_fields)
        return Union[(Literal[names], *groups)]

    def named(self, hint: Any) -> list[Any]:
        """Return the classes that are written as a name, for a hint `str | Base`."""
        return [cls for cls in classes_below(_base(hint)) if not cls.model_fields]

    def models(self, hint: Any) -> dict[str, type[BaseModel]]:
        """Return the models of a choice by name, in the order in which they stand there."""
        return {m.__name__: m for m in get_args(hint) if isinstance(m, type) and issubclass(m, BaseModel)}

    def tag(self, hint: Any, value: Any) -> str:
        """Return the name of the model that a value is of, or `name`."""
        if isinstance(value, BaseModel):
            return type(value).__name__
        if not isinstance(value, dict):
            return "name"
        models = self.models(hint)

        def known(name: str) -> int:
            return sum(bool(get_close_matches(str(key), models[name].model_fields, 1)) for key in value)

        return max(models, key=known)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        hint = self.union(source)
        names = next(member for member in get_args(hint) if get_origin(member) is Literal)
        choices = {"name": names, **self.models(hint)}
        return core_schema.tagged_union_schema(
            {tag: handler.generate_schema(member) for tag, member in choices.items()},
            discriminator=lambda value: self.tag(hint, value),
        )


class Shorthand(ABC):
    """Marks a field, most often a row, that has a short form in a file."""

    @abstractmethod
    def expand(self, value: Any) -> Any:
        """Return the full form of a value in either form."""

    @abstractmethod
    def shorten(self, row: Any) -> Any:
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

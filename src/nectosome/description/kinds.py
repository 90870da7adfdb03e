"""Kinds: the classes below one base, which a file tells apart by `kind`."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel, Field, GetCoreSchemaHandler
from pydantic_core import core_schema


def kinds_of(base: type[BaseModel]) -> dict[str, type[BaseModel]]:
    """Return the classes below `base` that have a kind of their own, by kind, in the order of their definition."""
    found: dict[str, type[BaseModel]] = {}
    for cls in base.__subclasses__():
        own = cls.model_fields["kind"].annotation
        found |= {get_args(own)[0]: cls} if get_origin(own) is Literal else kinds_of(cls)
    return found


def _every(kind: Any) -> bool:
    return True


@dataclass(frozen=True)
class OneOf:
    """Marks a base class in a field: each of its kinds is known there; messages name those that are `fitting`."""

    fitting: Callable[[Any], bool] = _every

    def union(self, base: type[BaseModel]) -> Any:
        """Return the union of all kinds of `base`."""
        return Union[tuple(kinds_of(base).values())]  # noqa: UP007  known when this is run only

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        return handler.generate_schema(Annotated[self.union(source), Field(discriminator="kind")])

"""Walking a description, or the raw data of one: what belongs at a key, which places hold quantities; plain data."""

import math
from collections.abc import Container, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property
from types import NoneType, UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from nectosome.io.schema.described import Described, NameOrGroup, OneOf, Shorthand
from nectosome.io.schema.quantity import Quantity, QuantityOrGroup, Si, Uncertain, spread_text
from nectosome.units import format_quantity


@dataclass(frozen=True)
class Slot:
    """A place in a description: the type that belongs there, and what is attached to it."""

    hint: Any
    metadata: tuple[Any, ...] = ()

    @cached_property
    def quantity(self) -> Quantity | None:
        """The quantity that belongs here, if it is one."""
        return next((m for m in self.metadata if isinstance(m, Quantity)), None)

    def model(self, data: Any) -> type[BaseModel] | None:
        """Return the model that belongs here; of several kinds, the one that `data` says it is."""
        if isinstance(self.hint, type) and issubclass(self.hint, BaseModel):
            return self.hint
        if isinstance(data, BaseModel):
            return type(data)
        if isinstance(self.quantity, QuantityOrGroup):
            return self.quantity.group if isinstance(data, dict) else None
        if self.groups is not None:
            return self.groups.models(self.hint).get(self.groups.tag(self.hint, data))
        kind = self.choice(data)
        return self.kinds().get(kind) if isinstance(kind, str) else None

    @cached_property
    def groups(self) -> NameOrGroup | None:
        """The mark of a choice between names and groups of fields, if it is one."""
        return next((m for m in self.metadata if isinstance(m, NameOrGroup)), None)

    @property
    def varies(self) -> bool:
        """Whether a quantity belongs here that may take any value once the file is read."""
        return self.quantity is not None and not self.quantity.fixed

    @property
    def literals(self) -> tuple[Any, ...]:
        """The names of which one may stand here."""
        members = (self.hint,) if self.groups is None else get_args(self.hint)
        return next((get_args(member) for member in members if get_origin(member) is Literal), ())

    def choice(self, data: Any) -> str | None:
        """Return what errors call the member of a choice that `data` is of; None where there is no choice."""
        if isinstance(self.quantity, QuantityOrGroup):
            return self.quantity.tag(data)
        if self.groups is not None:
            return self.groups.tag(self.hint, data)
        if self._default is not None:
            return self._default.kind_of(data)
        return data.get("kind") if isinstance(data, dict) and self.kinds() else None

    @cached_property
    def _default(self) -> OneOf | None:
        """The mark of a choice by kind that has a default, if it is one."""
        return next((m for m in self.metadata if isinstance(m, OneOf) and m.default is not None), None)

    def kinds(self) -> dict[str, type[BaseModel]]:
        """Return the models of a choice by kind, empty where there is no such choice."""
        one = self._default is None and get_origin(self.hint) not in (Union, UnionType)
        if self.groups or self.quantity or one:
            return {}
        models = [m for m in get_args(self.hint) or (self.hint,) if isinstance(m, type) and issubclass(m, BaseModel)]
        return {get_args(model.model_fields["kind"].annotation)[0]: model for model in models}

    def fitting(self) -> list[str]:
        """Return the kinds that belong here: all, or those that `OneOf` calls fitting."""
        marks = [mark for mark in self.metadata if isinstance(mark, OneOf)]
        return [kind for kind, cls in self.kinds().items() if all(mark.fitting(cls) for mark in marks)]

    def child(self, key: str | int, data: Any) -> "Slot | None":
        """Return the place under `key`, where `data` stands here; None if there is none."""
        model = self.model(data)
        if model is not None:
            return _fields(model).get(str(key))
        origin, args = get_origin(self.hint), get_args(self.hint)
        if origin is dict:
            return slot(args[1])
        if origin is tuple and str(key).isdigit():
            index = 0 if args[-1] is Ellipsis else int(key)
            return slot(args[index]) if index < len(args) else None
        return None

    def names(self, data: Any) -> list[str]:
        """Return the names that may stand here: fields of a model, or keys where only some are allowed."""
        model = self.model(data)
        if model is not None:
            return list(model.model_fields)
        if get_origin(self.hint) is dict and get_origin(get_args(self.hint)[0]) is Literal:
            return list(get_args(get_args(self.hint)[0]))
        return []


@cache
def _fields(model: type[BaseModel]) -> dict[str, Slot]:
    """The places of a model's fields."""
    return {name: slot(field.annotation, tuple(field.metadata)) for name, field in model.model_fields.items()}


def slot(annotation: Any, metadata: tuple[Any, ...] = ()) -> Slot:
    """Return the place of a type: `Annotated` and `| None` are taken off, a base class becomes its kinds."""
    if get_origin(annotation) is Annotated:
        bare, *more = get_args(annotation)
        for mark in more:
            metadata += tuple(mark.metadata) if isinstance(mark, FieldInfo) else (mark,)
        return slot(bare, metadata)
    if get_origin(annotation) in (Union, UnionType):
        members = [a for a in get_args(annotation) if a is not NoneType]
        if len(members) == 1:
            return slot(members[0], metadata)
    kinds = next((mark for mark in metadata if isinstance(mark, OneOf | NameOrGroup)), None)
    return Slot(annotation if kinds is None else kinds.union(annotation), metadata)


def items(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the keys and the values directly under a model, a dict or a tuple; nothing under a leaf."""
    if isinstance(value, BaseModel):
        yield from ((name, getattr(value, name)) for name in type(value).model_fields)
    elif isinstance(value, dict):
        yield from value.items()
    elif isinstance(value, tuple | list):
        yield from ((str(i), item) for i, item in enumerate(value))


def models_in(hint: Any) -> list[type[BaseModel]]:
    """Return every model that what `hint` describes may hold, the outer ones first."""
    models: list[type[BaseModel]] = []
    waiting = [slot(hint)]
    while waiting:
        here = waiting.pop(0)
        if isinstance(here.hint, type) and issubclass(here.hint, BaseModel):
            if here.hint not in models:
                models.append(here.hint)
                waiting += [slot(f.annotation, tuple(f.metadata)) for f in here.hint.model_fields.values()]
        else:
            waiting += [slot(a) for a in get_args(here.hint)]
    return models


def leaves(description: BaseModel) -> Iterator[tuple[str, Slot]]:
    """Yield the path and the slot of every single value in `description`, quantity or not."""
    for path, here, _ in _leaves(description, slot(type(description)), ""):
        yield path, here


def _leaves(value: Any, here: Slot, path: str, out: Container[str] | None = None) -> Iterator[tuple[str, Slot, Any]]:
    """Those below a path, but for what is below the paths `out`."""
    if not isinstance(value, BaseModel | dict | tuple):
        if value is not None:
            yield path, here, value
        return
    for key, item in items(value):
        below, at = here.child(key, value), f"{path}.{key}" if path else key
        if below is not None and (out is None or at not in out):
            yield from _leaves(item, below, at, out)


def numeric_paths(description: BaseModel) -> dict[str, Quantity]:
    """Return the quantities that have a value in `description`, vary and have an effect, by path."""
    return {path: here.quantity for path, here, _ in _varying(description) if here.quantity is not None}


def numeric_values(description: BaseModel) -> dict[str, Any]:
    """Return the SI values of the quantities that have one, by path, in the order of `numeric_paths`."""
    return {path: value for path, _, value in _varying(description)}


def _varying(description: BaseModel) -> Iterator[tuple[str, Slot, Any]]:
    every = _leaves(description, slot(type(description)), "", decided_paths(description))
    return (leaf for leaf in every if leaf[1].varies)


def decided_paths(value: Any, path: str = "") -> dict[str, str]:
    """Return the paths below which numbers have no effect in a description, each with the path of what decides it."""
    before = f"{path}." if path else ""
    own = value.decided if isinstance(value, Described) else {}
    found = {before + at: before + by for at, by in own.items()}
    for key, item in items(value):
        found |= decided_paths(item, before + key) if isinstance(item, BaseModel | dict | tuple) else {}
    return found


def decider(description: BaseModel, path: str) -> str | None:
    """Return the path of what decides the number at a path, so that this one has no effect; None where none does."""
    value: Any = description
    before = ""
    for key in path.split("."):
        for at, by in value.decided.items() if isinstance(value, Described) else ():
            if f"{path}.".startswith(f"{before}{at}."):
                return before + by
        value, before = dict(items(value)).get(key), f"{before}{key}."
    return None


def at_path(description: BaseModel, path: str) -> tuple[Slot | None, Any]:
    """Return the slot and the value at a path of `description`; None for what is not there."""
    here: Slot | None = slot(type(description))
    value: Any = description
    for key in path.split("."):
        here = here.child(key, value) if here is not None else None
        value = dict(items(value)).get(key)
    return here, value


def value_at(value: Any, path: str) -> Any:
    """Return what stands at a path under `value`. Raises KeyError."""
    for key in path.split("."):
        value = dict(items(value))[key]
    return value


def changed(value: Any, changes: Mapping[str, Any]) -> Any:
    """Return `value` with other values put at paths under it; they are not checked."""
    tree: dict[str, Any] = {}
    for path, new in changes.items():
        branch = tree
        *parents, leaf = path.split(".")
        for key in parents:
            branch = branch.setdefault(key, {})
        branch[leaf] = new
    return _changed(value, tree)


def _changed(value: Any, tree: Any) -> Any:
    """Return `value` with a tree of changes, whose branches are dicts, put into it."""
    if not isinstance(tree, dict):
        return tree
    new = {key: _changed(item, tree[key]) for key, item in items(value) if key in tree}
    if isinstance(value, dict):
        return {**value, **new}
    if isinstance(value, tuple):
        return tuple(new.get(str(i), item) for i, item in enumerate(value))
    return value.model_copy(update=new)


def shortest(names: Iterable[str]) -> dict[str, str]:
    """Return by name as few of its last words as tell it from the others: `start` for `limbs.shaft.motion.start`.

    A number in a row keeps the row's name: `chord.0`.
    """
    words = [name.split(".") for name in names]

    def last(name: list[str], n: int) -> str:
        return ".".join(name[-n:])

    short = {}
    for own in words:
        least = 2 if own[-1].isdigit() else 1
        enough = (n for n in range(least, len(own) + 1) if [last(w, n) for w in words].count(last(own, n)) == 1)
        short[".".join(own)] = last(own, next(enough, len(own)))
    return short


def to_plain(value: Any, here: Slot | None = None, *, si: bool = False) -> Any:
    """Return the plain data that reads back as exactly `value`, without what is at its default.

    `here` is the slot of the value. With `si`, quantities stay numbers, in SI units.
    """
    here = here or slot(type(value))
    plain = _plain(value, here, si)
    short = next((m for m in here.metadata if isinstance(m, Shorthand)), None)
    return plain if short is None else short.shorten(plain)


def _plain(value: Any, here: Slot, si: bool) -> Any:
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        told = value.beside_defaults if isinstance(value, Described) else frozenset[str]()
        shown = [
            (key, to_plain(item, here.child(key, value), si=si))
            for key, item in items(value)
            if fields[key].is_required() or item != fields[key].get_default(call_default_factory=True) or key in told
        ]
        return dict(sorted(shown, key=lambda pair: 0 if pair[0] == "kind" else 1 + isinstance(pair[1], dict)))
    if here.quantity is not None and si:
        return value if isinstance(value, Uncertain) else Si(value)
    if here.quantity is not None:
        dimension, plain = here.quantity.dimension, not (here.quantity.unit or isinstance(value, Uncertain))
        return _short_number(value) if plain else format_quantity(value, dimension) + spread_text(value, dimension)
    if isinstance(value, dict):
        return {k: to_plain(v, here.child(k, value), si=si) for k, v in value.items()}
    if isinstance(value, tuple):
        return [to_plain(v, here.child(i, value), si=si) for i, v in enumerate(value)]
    return value


def _short_number(value: float) -> float:
    """Return a whole number without its `.0`, where nothing is lost (not -0.0)."""
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1, value) > 0)
    return int(value) if whole else value

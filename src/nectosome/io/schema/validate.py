"""Plain data to a description; an error names file, line and field of the first mistake, and the remedy."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel, ValidationError, WithJsonSchema

from nectosome.io.schema.kinds import KINDS, check_kind
from nectosome.io.schema.quantity import QuantitySource, given
from nectosome.io.schema.structure import Slot, slot
from nectosome.io.yaml_text import Key
from nectosome.units import InputError, count, did_you_mean, expected, shorten

_Model = TypeVar("_Model", bound=BaseModel)
_COUNT = {1: "one", 2: "two", 3: "three"}
NAMING = "Write small letters, digits and underscores, a letter first."


@dataclass(frozen=True)
class _Spot:
    """Where a mistake is: its path, what belongs there, what was given, and the same of the group around it."""

    path: Key
    slot: Slot | None
    value: Any
    around: Slot | None
    data: Any

    def down(self, step: str | int) -> "_Spot":
        """Return the spot one step further in."""
        below = self.slot.child(step, self.value) if self.slot is not None else None
        value = None
        if isinstance(self.value, dict):
            value = self.value.get(str(step))
        elif isinstance(self.value, list) and isinstance(step, int) and step < len(self.value):
            value = self.value[step]
        return _Spot((*self.path, step), below, value, self.slot, self.value)

    @property
    def in_row(self) -> bool:
        """Whether this is one item of a list."""
        return self.around is not None and get_origin(self.around.hint) is tuple


def _sentence(mistake: Any, spot: _Spot) -> str:
    """Return what is wrong and the remedy, for one of pydantic's errors."""
    kind, name = mistake["type"], str(spot.path[-1]) if spot.path else ""
    if kind == "empty" and name == "kind" and spot.around is not None and spot.around.kinds():
        return _bad_kind(spot.data, spot.around)
    if "why" in mistake.get("ctx", {}):
        return mistake["ctx"]["why"]
    known = spot.around.names(spot.data) if spot.around is not None else []
    if mistake["loc"][-1] == "[key]":
        return f'"{shorten(name)}" is not known here.{did_you_mean(name, known)}' if known else _bad_name(name)
    if kind == "extra_forbidden":
        return f'there is no field "{shorten(name)}" here.{did_you_mean(name, known)}'
    if kind in ("missing", "too_long") and spot.in_row and spot.around is not None:
        row, data = (spot.slot or spot.around, spot.value) if kind == "too_long" else (spot.around, spot.data)
        number = len(data) if isinstance(data, list) else 1
        return f"{_row(get_args(row.hint))} expected, {number} given."
    if kind == "too_short":
        least, there = mistake["ctx"]["min_length"], mistake["ctx"]["actual_length"]
        return f"at least {count(least, 'value')} expected, {there} given."
    if kind == "missing":
        return f"is missing. {_expectation(spot.slot)}".strip()
    if kind in ("union_tag_invalid", "union_tag_not_found") and spot.slot is not None:
        return _bad_kind(spot.value, spot.slot)
    if kind == "literal_error" and spot.slot is not None:
        also = f" {spot.slot.groups.also}" if spot.slot.groups else ""
        return f"{given(spot.value)} is not known here.{did_you_mean(str(spot.value), spot.slot.literals)}{also}"
    if kind == "string_pattern_mismatch":
        return _bad_name(spot.value)
    return f"{given(spot.value)} does not fit here. {_expectation(spot.slot)}".strip()


def _bad_name(name: Any) -> str:
    return f'"{shorten(name)}" cannot be used as a name. {NAMING}'


def _bad_kind(value: Any, slot: Slot) -> str:
    kinds = slot.fitting()
    if not isinstance(value, dict) or value.get("kind") is None:
        return f"the kind is missing. Write one of {', '.join(kinds)}."
    return f'there is no kind "{shorten(value["kind"])}" here.{did_you_mean(str(value["kind"]), kinds, len(kinds))}'


def _expectation(slot: Slot | None) -> str:
    """Return what belongs in a slot: `Pressure expected, as in ...`, `A whole number from 0 to 20 expected.`"""
    if slot is None:
        return ""
    if slot.quantity is not None:
        return expected(slot.quantity.dimension)
    shown = next((m.json_schema for m in slot.metadata if isinstance(m, WithJsonSchema)), None) or {}
    if "examples" in shown:
        return f"Expected is a value as in {' or '.join(map(str, shown['examples']))}."
    if slot.kinds():
        return f"A group of fields expected, with the kind {', '.join(slot.fitting())}."
    if slot.literals:
        return f"One of {', '.join(map(str, slot.literals))} expected."
    if get_origin(slot.hint) is tuple:
        return f"{_row(get_args(slot.hint)).capitalize()} expected."
    if slot.hint is str:
        return "A text expected."
    if slot.hint is bool:
        return "True or false expected."
    if slot.hint in (int, float):
        return f"{'A whole number' if slot.hint is int else 'A number'} {_limits(slot)} expected."
    return "A group of fields expected."


def _row(items: tuple[Any, ...]) -> str:
    return "a list" if items[-1] is Ellipsis else f"a list of {_COUNT[len(items)]} values"


def _limits(slot: Slot) -> str:
    low = high = ""
    between = "from {} to {}"
    for limit in slot.metadata:
        if isinstance(limit, Ge | Gt):
            low = limit.ge if isinstance(limit, Ge) else limit.gt
            between = between if isinstance(limit, Ge) else "between {} and {}"
        if isinstance(limit, Le | Lt):
            high = limit.le if isinstance(limit, Le) else limit.lt
    return between.format(low, high)


def validate_as(
    model: type[_Model],
    data: Any,
    kind: str,
    *,
    file: str | None = None,
    lines: Mapping[Key, int] | None = None,
    folder: Path | None = None,
    most_rows: int = 20_000,
) -> _Model:
    """Return the `model` in plain `data`. Raises InputError, also for data of another kind of file than `kind`.

    Names of other files are relative to `folder`, else to that of `file`; recordings have at most `most_rows`.
    """
    if not isinstance(data, dict):
        what = "is empty" if data is None else "has no named fields"
        raise InputError(f"this {what}. {KINDS[kind].least}", file=file)
    mistakes: list[Any] = []
    description = None
    try:
        description = model.model_validate(data, context=QuantitySource(folder or Path(file or "").parent, most_rows))
    except ValidationError as error:
        mistakes = error.errors(include_url=False)
    unknown = next((mistake for mistake in mistakes if mistake["type"] == "extra_forbidden"), None)
    empty = None if unknown else next(_empty(_Spot((), slot(model), data, None, None)), None)
    if description is not None and empty is None:
        return description
    check_kind(data, kind, file)
    mistake: Any = {"type": "empty", "loc": empty.path} if empty else unknown or mistakes[0]
    spot = empty or _locate(model, mistake["loc"], data)
    path = spot.path
    inner = mistake.get("ctx", {}).get("field")
    if inner is not None:
        path += tuple(inner.split("."))
    elif spot.in_row and mistake["type"] == "missing":
        path = path[:-1]
    field = shorten(".".join(map(str, path)), 120) or None
    raise InputError(_sentence(mistake, spot), file=file, line=line_of(path, lines or {}), field=field)


def _locate(model: type[BaseModel], loc: tuple[int | str, ...], data: Any) -> _Spot:
    """Follow pydantic's location through the data, past the marks it adds: kinds of a choice and `[key]`."""
    spot = _Spot((), slot(model), data, None, None)
    choice: str | None = None
    for step in loc:
        if step == "[key]":
            continue
        if step == choice:
            choice = None
            continue
        spot = spot.down(step)
        choice = None if spot.slot is None else spot.slot.choice(spot.value)
    return spot


def _empty(spot: _Spot) -> Iterator[_Spot]:
    """Yield the spots at which a field has a name and no value."""
    if spot.value is None:
        yield spot
    if isinstance(spot.value, dict):
        for key in spot.value:
            yield from _empty(spot.down(key))
    elif isinstance(spot.value, list):
        for index in range(len(spot.value)):
            yield from _empty(spot.down(index))


def line_of(path: Key, lines: Mapping[Key, int]) -> int | None:
    """Return the line of `path`, or of the nearest group around it."""
    return next((lines[path[:n]] for n in range(len(path), -1, -1) if path[:n] in lines), None)


@contextmanager
def errors_at(file: str, lines: Mapping[Key, int], *path: str | int) -> Iterator[None]:
    """Errors of what is read here are those of the field at `path` in a file."""
    try:
        yield
    except InputError as error:
        field = shorten(".".join(map(str, path)), 120)
        raise InputError(error.message, file=file, line=line_of(path, lines), field=field) from None

"""Plain data to a description; an error names file, line and field of the first mistake that pydantic finds."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from nectosome.description.fields import QuantitySource
from nectosome.description.messages import Spot, sentence
from nectosome.description.robot import RobotDescription
from nectosome.description.structure import slot
from nectosome.io.yaml_text import Key
from nectosome.units import InputError, shorten

_Model = TypeVar("_Model", bound=BaseModel)


def validate(data: Any, *, file: str | None = None, lines: Mapping[Key, int] | None = None) -> RobotDescription:
    """Return the description in plain `data`; InputError names file, line and field of the first mistake."""
    return validate_as(
        RobotDescription, data, "A robot has at least a name and a body or limbs.", file=file, lines=lines
    )


def validate_as(
    model: type[_Model], data: Any, least: str, *, file: str | None = None, lines: Mapping[Key, int] | None = None
) -> _Model:
    """Return the `model` in plain `data`; `least` says in a sentence what it needs at least. Raises InputError."""
    if not isinstance(data, dict):
        what = "is empty" if data is None else "has no named fields"
        raise InputError(f"this {what}. {least}", file=file)
    found: list[Any] = []
    description = None
    try:
        description = model.model_validate(data, context=QuantitySource(Path(file or "").parent))
    except ValidationError as error:
        found = error.errors(include_url=False)
    unknown = next((mistake for mistake in found if mistake["type"] == "extra_forbidden"), None)
    empty = None if unknown else next(_empty(Spot((), slot(model), data, None, None)), None)
    if description is not None and empty is None:
        return description
    mistake: Any = {"type": "empty", "loc": empty.path} if empty else unknown or found[0]
    spot = empty or _locate(model, mistake["loc"], data)
    path = spot.path
    inner = mistake.get("ctx", {}).get("field")
    if inner is not None:
        path += tuple(inner.split("."))
    elif spot.in_row and mistake["type"] in ("missing", "too_long"):
        path = path[:-1]
    field = shorten(".".join(map(str, path)), 120) or None
    raise InputError(sentence(mistake, spot), file=file, line=line_of(path, lines or {}), field=field)


def _locate(model: type[BaseModel], loc: tuple[int | str, ...], data: Any) -> Spot:
    """Follow pydantic's location through the data, past the marks it adds: kinds of a choice and `[key]`."""
    spot = Spot((), slot(model), data, None, None)
    after_choice = False
    for step in loc:
        if step == "[key]":
            continue
        if after_choice and isinstance(spot.value, dict) and spot.value.get("kind") == step:
            after_choice = False
            continue
        spot = spot.down(step)
        after_choice = spot.slot is not None and bool(spot.slot.kinds())
    return spot


def _empty(spot: Spot) -> Iterator[Spot]:
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

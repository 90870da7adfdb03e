"""Robot files: YAML to a description and back, by way of plain data (text with units, lists and dicts)."""

import math
from pathlib import Path
from typing import Any

from pydantic import BaseModel

from nectosome.description.base import Shorthand
from nectosome.description.fields import Si
from nectosome.description.robot import RobotDescription, check_description
from nectosome.description.structure import Slot, items, slot
from nectosome.description.validate import validate
from nectosome.io.atomic import write_atomic
from nectosome.io.yaml_text import read_text, read_yaml, write_yaml
from nectosome.units import format_quantity


def load_robot(path: str | Path) -> RobotDescription:
    """Return the robot described in the YAML file at `path`.

    Raises InputError with file, line and field for whatever is wrong: no such file, no text, no YAML, no robot.
    """
    return parse_robot(read_text(path), str(path))


def parse_robot(text: str, source: str = "robot") -> RobotDescription:
    """Return the robot described in YAML `text`; `source` names it in messages. Raises InputError."""
    data, lines = read_yaml(text, source)
    return validate(data, file=source, lines=lines)


def dump_robot(description: RobotDescription) -> str:
    """Return YAML text with readable units that loads as exactly the same description."""
    return write_yaml(to_plain(description))


def save_robot(description: RobotDescription, path: str | Path) -> None:
    """Write a robot file that `load_robot` reads as exactly the same description, whole or not at all.

    Raises InputError for what is no description, and where it cannot be written.
    """
    check_description(description)
    write_atomic(path, dump_robot(description).encode())


def to_plain(value: Any, here: Slot | None = None, *, si: bool = False) -> Any:
    """Return the plain data that reads back as exactly `value`, without what is at its default.

    `here` is the slot of the value. With `si`, quantities stay numbers, in SI units.
    """
    here = here or slot(type(value))
    if here.quantity is not None and si:
        return Si(value)
    if here.quantity is not None:
        return format_quantity(value, here.quantity.dimension) if here.quantity.unit else _short_number(value)
    if isinstance(value, BaseModel):
        fields = type(value).model_fields
        shown = [
            (key, to_plain(item, here.child(key, value), si=si))
            for key, item in items(value)
            if fields[key].is_required() or item != fields[key].get_default(call_default_factory=True)
        ]
        return dict(sorted(shown, key=lambda pair: 0 if pair[0] == "kind" else 1 + isinstance(pair[1], dict)))
    if isinstance(value, dict):
        return {k: to_plain(v, here.child(k, value), si=si) for k, v in value.items()}
    if isinstance(value, tuple):
        row = [to_plain(v, here.child(i, value), si=si) for i, v in enumerate(value)]
        short = next((m for m in here.metadata if isinstance(m, Shorthand)), None)
        return row if short is None else short.shorten(row)
    return value


def _short_number(value: float) -> float:
    """Return a whole number without its `.0`, where nothing is lost (not -0.0)."""
    whole = value.is_integer() and abs(value) < 1e15 and (value != 0 or math.copysign(1, value) > 0)
    return int(value) if whole else value


def json_schema() -> dict[str, Any]:
    """Return the JSON schema of a robot file, for editors."""
    schema = RobotDescription.model_json_schema()
    names = {name: model["title"] for name, model in schema["$defs"].items()}  # such as SineAngle of SineSignal[Angle]
    schema["$defs"] = {names[name]: model for name, model in schema["$defs"].items()}
    return _renamed(schema, {f"#/$defs/{old}": f"#/$defs/{new}" for old, new in names.items()})


def _renamed(schema: Any, names: dict[str, str]) -> Any:
    """Return a schema whose references go by other names."""
    if isinstance(schema, dict):
        return {key: _renamed(value, names) for key, value in schema.items()}
    if isinstance(schema, list):
        return [_renamed(value, names) for value in schema]
    return names.get(schema, schema) if isinstance(schema, str) else schema

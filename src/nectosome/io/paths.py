"""Every quantity of a robot by its path, such as `limbs.filament.young` or `body.offset.2`; aliases name paths."""

from collections.abc import Mapping
from typing import Any

from nectosome.io.description import RobotDescription
from nectosome.io.errors import InputError, did_you_mean, shorten
from nectosome.io.fields import Quantity
from nectosome.io.structure import items, quantities, quantity_at


def numeric_paths(description: RobotDescription) -> dict[str, Quantity]:
    """Return every quantity that has a value, by path, with its dimension, SI unit and range."""
    return quantities(description)


def resolve(description: RobotDescription, name: str) -> list[str]:
    """Return the paths that an alias stands for, or the path itself. Raises InputError for an unknown name."""
    if name in description.aliases:
        return list(description.aliases[name])
    if quantity_at(description, name) is not None:
        return [name]
    known = quantities(description)
    near = did_you_mean(name, [*description.aliases, *known])
    raise InputError(f'there is no quantity called "{shorten(name)}" in {description.name}.{near}')


def get_value(description: RobotDescription, name: str) -> Any:
    """Return the SI value at a path or alias; an alias of several paths gives that of the first. Raises InputError."""
    value: Any = description
    for key in resolve(description, name)[0].split("."):
        value = dict(items(value))[key]
    return value


def with_values(description: RobotDescription, values: Mapping[str, Any]) -> RobotDescription:
    """Return a copy with SI values put at paths or aliases. They are not checked, so that they may be JAX tracers.

    Raises InputError for an unknown name.
    """
    changes: dict[str, Any] = {}
    for name, value in values.items():
        for path in resolve(description, name):
            branch = changes
            *parents, leaf = path.split(".")
            for key in parents:
                branch = branch.setdefault(key, {})
            branch[leaf] = value
    return _changed(description, changes)


def _changed(value: Any, changes: Any) -> Any:
    """Return `value` with a tree of changes, whose branches are dicts, put into it."""
    if not isinstance(changes, dict):
        return changes
    new = {key: _changed(item, changes[key]) for key, item in items(value) if key in changes}
    if isinstance(value, dict):
        return {**value, **new}
    if isinstance(value, tuple):
        return tuple(new.get(str(i), item) for i, item in enumerate(value))
    return value.model_copy(update=new)

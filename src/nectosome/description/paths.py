"""Every quantity of a robot by its path, such as `limbs.filament.young` or `body.offset.2`; aliases name paths."""

from collections.abc import Iterable, Mapping
from typing import Any

from nectosome.description.robot import RobotDescription
from nectosome.description.structure import at_path, changed, numeric_paths, value_at
from nectosome.units import InputError, did_you_mean, shorten


def resolve(description: RobotDescription, name: str) -> list[str]:
    """Return the paths that an alias stands for, or the path itself. Raises InputError for an unknown name."""
    if name in description.aliases:
        return list(description.aliases[name])
    here, value = at_path(description, name)
    if here is not None and here.quantity is not None and value is not None:
        return [name]
    known = numeric_paths(description)
    near = did_you_mean(name, [*description.aliases, *known])
    raise InputError(f'there is no quantity called "{shorten(name)}" in {description.name}.{near}')


def shortest(names: Iterable[str]) -> dict[str, str]:
    """Return by name as few of its last words as tell it from the others: `start` for `limbs.shaft.motion.start`."""
    words = [name.split(".") for name in names]

    def last(name: list[str], n: int) -> str:
        return ".".join(name[-n:])

    found = {}
    for own in words:
        enough = (n for n in range(1, len(own) + 1) if [last(w, n) for w in words].count(last(own, n)) == 1)
        found[".".join(own)] = last(own, next(enough, len(own)))
    return found


def get_value(description: RobotDescription, name: str) -> Any:
    """Return the SI value at a path or alias; an alias of several paths gives that of the first. Raises InputError."""
    return value_at(description, resolve(description, name)[0])


def with_values(description: RobotDescription, values: Mapping[str, Any]) -> RobotDescription:
    """Return a copy with SI values put at paths or aliases. They are not checked, so that they may be JAX tracers.

    Raises InputError for an unknown name.
    """
    return changed(description, {path: value for name, value in values.items() for path in resolve(description, name)})

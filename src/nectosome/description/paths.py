"""Every quantity of a robot by its path, such as `limbs.filament.young` or `body.offset.2`; aliases name paths."""

from collections.abc import Iterable, Mapping
from typing import Any

from nectosome.description.fields import Quantity
from nectosome.description.robot import RobotDescription
from nectosome.description.structure import changed, quantities, quantity_at, quantity_values, value_at
from nectosome.units import InputError, did_you_mean, shorten


def numeric_paths(description: RobotDescription) -> dict[str, Quantity]:
    """Return every quantity that has a value, by path, with its dimension, SI unit and range."""
    return quantities(description)


def numeric_values(description: RobotDescription) -> dict[str, Any]:
    """Return the SI value of every quantity that has one, by path, in the order of `numeric_paths`."""
    return quantity_values(description)


def resolve(description: RobotDescription, name: str) -> list[str]:
    """Return the paths that an alias stands for, or the path itself. Raises InputError for an unknown name."""
    if name in description.aliases:
        return list(description.aliases[name])
    if quantity_at(description, name) is not None:
        return [name]
    known = quantities(description)
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

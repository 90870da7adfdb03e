"""Categorical variables, such as the model of a servo from the catalogue: each value makes a robot of its own."""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any

from nectosome.description import RobotDescription, apply_settings
from nectosome.description.robot import is_choice
from nectosome.units import InputError


def choices_of(name: str, values: object) -> tuple[str, ...]:
    """The texts `a,b,c` that a choice takes, or texts one by one. Raises InputError for none and for one twice."""
    given = values.split(",") if isinstance(values, str) else values if isinstance(values, Iterable) else [values]
    found = tuple(str(text).strip() for text in given)
    if not all(found) or not found:
        raise InputError("takes no value: write a list, as in XC330-M288-T,XW540-T140-R.", field=name)
    if len(set(found)) < len(found):
        raise InputError("takes a value twice.", field=name)
    return found


def with_each_choice(
    description: RobotDescription, vary: Mapping[str, Any]
) -> tuple[dict[str, RobotDescription], dict[str, Any]]:
    """The robot with each combination of the choices in `vary`, by their values; and the rest of `vary`.

    Without a choice the robot itself, by an empty name. Raises InputError for a choice that does not fit the robot.
    """
    chosen = {name: choices_of(name, values) for name, values in vary.items() if is_choice(name, description)}
    rest = {name: values for name, values in vary.items() if name not in chosen}
    if not chosen:
        return {"": description}, rest
    found = {}
    for values in product(*chosen.values()):
        found[", ".join(values)] = apply_settings(description, dict(zip(chosen, values, strict=True)))
    return found, rest

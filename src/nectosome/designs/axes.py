"""Axes of a sweep: quantities of a robot and the values of each; categorical ones make a robot of each value."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Any

from nectosome.description import RobotDescription, numeric_paths, resolve
from nectosome.description.robot import is_choice
from nectosome.description.variables import values_in_steps
from nectosome.io.schema.quantity import Quantity, Uncertain
from nectosome.model.inputs import RobotLike, description_of
from nectosome.robots import is_count
from nectosome.units import InputError
from nectosome.units.ranges import split_range, with_last_unit

AxisValues = str | Iterable[float | str]


@dataclass(frozen=True)
class SweepAxis:
    """Values [SI] that a quantity takes one after another."""

    name: str  # path or alias, or a count
    values: tuple[float, ...]
    unit: str  # SI
    dimension: str


def axis_of(name: str, values: AxisValues, description: RobotDescription | None) -> SweepAxis:
    """Axis over a quantity at its path or alias: values as text, or one by one, numbers in SI or text with a unit.

    Text is a range with a step, `30..75:5deg`, on a logarithmic scale with the ratio of neighbouring values,
    `1..16MPa:2 log`, or a list, `30,45,75deg`; a number without a unit has that of the next one. A count of parts
    (`is_count`) takes steps of 1 and needs no description.

    Raises InputError for text that is neither, an unknown name, a value that its field does not allow, a value that
    occurs twice, and a step that does not lead from the low end to the high one.
    """
    parts = split_range(values) if isinstance(values, str) else None
    listed = with_last_unit([x.strip() for x in values.split(",")]) if isinstance(values, str) else [*values]
    if is_count(name):
        quantities = [Quantity("number")]
        parts = parts and parts._replace(step=parts.step or "1")
    elif description is None:
        raise InputError("is no count of parts.", field=name)
    else:
        known = numeric_paths(description)
        quantities = [known[path] for path in resolve(description, name)]
    try:
        if parts is not None:
            listed = values_in_steps(parts, quantities[0])
        read = [[q.read(x, units_required=isinstance(x, str)) for q in quantities] for x in listed]
    except ValueError as error:
        raise InputError(str(error), field=name) from None
    found = tuple(row[0] for row in read)
    if any(isinstance(x, Uncertain) for x in found):
        raise InputError("has a +-, which values of an axis have not. Leave it out.", field=name)
    if not found:
        raise InputError("takes no value: at least one is needed.", field=name)
    if len(set(found)) < len(found):
        raise InputError("takes a value twice.", field=name)
    if is_count(name) and any(x != int(x) or x < 0 for x in found):
        raise InputError(f"is a count: whole numbers, as in {name}=2,3,4.", field=name)
    return SweepAxis(name, found, quantities[0].unit, quantities[0].dimension)


def check_each_once(
    quantities: Iterable[tuple[str, Iterable[str]]], field: str, taken: Mapping[str, str] | None = None
) -> None:
    """Raise InputError where two names set the same quantity, so that one of them would be ignored.

    - quantities: names with the paths that they stand for; taken: paths that are set already, and by what.
    """
    known = dict(taken or {})
    for name, paths in quantities:
        for path in paths:
            if known.setdefault(path, name) != name:
                raise InputError(f"{known[path]} and {name} both set {path}. Take one of them.", field=field)


def paths_of(name: str, description: RobotDescription) -> list[str]:
    """Paths of a quantity; none where there is no such quantity, of which others tell."""
    try:
        return resolve(description, name)
    except InputError:
        return []


def set_paths(names: Iterable[str], description: RobotDescription) -> dict[str, str]:
    """Paths that settings set, by name, and which sets each; for `check_each_once`."""
    return {path: f"set {name}" for name in names for path in paths_of(name, description)}


def choices_of(name: str, values: object) -> tuple[str, ...]:
    """The texts `a,b,c` that a choice takes, or texts one by one. Raises InputError for none and for one twice."""
    given = values.split(",") if isinstance(values, str) else values if isinstance(values, Iterable) else [values]
    words = tuple(str(text).strip() for text in given)
    if not all(words) or not words:
        raise InputError("takes no value: write a list, as in XC330-M288-T,XW540-T140-R.", field=name)
    if len(set(words)) < len(words):
        raise InputError("takes a value twice.", field=name)
    return words


def structures_of(
    robot: RobotLike, over: Mapping[str, Any], settings: list[str]
) -> dict[str, tuple[int, ...] | tuple[str, ...]]:
    """What makes another structure for each of its values, with these: counts of parts and of copies, and choices.

    Raises InputError for values that make no sense, and for counts of a robot that is not given by a name or a file.
    """
    found: dict[str, tuple[int, ...] | tuple[str, ...]] = {}
    for name in filter(is_count, over):
        if not isinstance(robot, str | Path):
            raise InputError("counts the parts of a family or a file: give the robot by its name.", field=name)
        found[name] = tuple(int(n) for n in axis_of(name, over[name], None).values)
    one = description_of(robot, [*settings, *(f"{name}={n[0]}" for name, n in found.items())])
    choices = [name for name in over if name not in found and is_choice(name, one)]
    return found | {name: choices_of(name, over[name]) for name in choices}


def each_structure(
    robot: RobotLike, structures: Mapping[str, Iterable[int | str]], settings: list[str]
) -> dict[tuple[int | str, ...], RobotDescription]:
    """The robot with each combination of the values of `structures_of`, by these. Raises InputError as that does."""
    found = {}
    for values in product(*structures.values()):
        own = [f"{name}={value}" for name, value in zip(structures, values, strict=True)]
        found[values] = description_of(robot, [*settings, *own])
    return found

"""Axes of a sweep: quantities of a robot and the values of each; categorical ones make a robot of each value."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

from nectosome.description import RobotDescription, apply_settings, numeric_paths, resolve
from nectosome.description.robot import is_choice
from nectosome.io.schema.quantity import Quantity
from nectosome.units import InputError, parse_quantity, shorten, split_unit
from nectosome.units.ranges import RangeText, split_range, with_last_unit

AxisValues = str | Iterable[float | str]
_MOST = 100_000  # values of an axis
COUNT = "N"  # of flagella or segments: another structure for each value


@dataclass(frozen=True)
class SweepAxis:
    """Values [SI] that a quantity takes one after another."""

    name: str  # path or alias, or "N"
    values: tuple[float, ...]
    unit: str  # SI
    dimension: str


def axis_of(name: str, values: AxisValues, description: RobotDescription | None) -> SweepAxis:
    """Axis over a quantity at its path or alias: values as text, or one by one, numbers in SI or text with a unit.

    Text is a range with a step, `30..75:5deg`, on a logarithmic scale with the ratio of neighbouring values,
    `1..16MPa:2 log`, or a list, `30,45,75deg`; a number without a unit has that of the next one. A count of parts, "N",
    takes steps of 1 and needs no description. Raises InputError for text that is neither, an unknown name, a value that
    its field does not allow, a value that occurs twice, and a step that does not lead from the low end to the high one.
    """
    parts = split_range(values) if isinstance(values, str) else None
    listed = with_last_unit([x.strip() for x in values.split(",")]) if isinstance(values, str) else [*values]
    if name == COUNT:
        quantities = [Quantity("number")]
        parts = parts and parts._replace(step=parts.step or "1")
    elif description is None:
        raise InputError("is no count of parts.", field=name)
    else:
        known = numeric_paths(description)
        quantities = [known[path] for path in resolve(description, name)]
    try:
        if parts is not None:
            listed = _steps(parts, quantities[0])
        read = [[q.read(x, units_required=isinstance(x, str)) for q in quantities] for x in listed]
    except ValueError as error:
        raise InputError(str(error), field=name) from None
    found = tuple(row[0] for row in read)
    if not found:
        raise InputError("takes no value: at least one is needed.", field=name)
    if len(set(found)) < len(found):
        raise InputError("takes a value twice.", field=name)
    if name == COUNT and any(x != int(x) or x < 0 for x in found):
        raise InputError("is a count: whole numbers, as in N=1,2,3.", field=name)
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


def _steps(parts: RangeText, quantity: Quantity) -> list[str | float]:
    """Values from the low end to the high one, both included where the step leads there. Raises ValueError."""
    if not parts.step:
        raise ValueError("needs a step, as in 30..75:5deg, or a list of values, as in 30,45,75deg.")
    texts = parts[:2] if parts.log else parts[:3]
    numbers, units = zip(*(split_unit(text) for text in texts), strict=True)
    unit = units[0]
    if len({*units}) > 1:
        numbers, unit = [parse_quantity(text, quantity.dimension) for text in texts], quantity.unit
    low, high, step = (*numbers, parse_quantity(parts.step, "number")) if parts.log else numbers
    if parts.log and not (low > 0 and step > 1):
        raise ValueError("on a logarithmic scale starts above 0 and has a ratio above 1, as in 1..16MPa:2 log.")
    width, each = (math.log(high / low), math.log(step)) if parts.log and high > 0 else (high - low, step)
    count = width / each if each else -1.0
    if not 0 <= count < _MOST:
        shown = shorten(f"{parts.low}..{parts.high}:{parts.step}")
        raise ValueError(f'"{shown}" leads nowhere, or is too fine. Write LOW..HIGH:STEP, as in 30..75:5deg.')
    steps = range(int(count + 1e-9) + 1)
    # in the unit that was written, and rounded, so that 0.3 + 6 x 0.1 is 0.9
    values = (float(f"{low * step**k if parts.log else low + k * step:.12g}") for k in steps)
    return [f"{x!r} {unit}".strip() for x in values]


def choices_of(name: str, values: object) -> tuple[str, ...]:
    """The texts `a,b,c` that a choice takes, or texts one by one. Raises InputError for none and for one twice."""
    given = values.split(",") if isinstance(values, str) else values if isinstance(values, Iterable) else [values]
    words = tuple(str(text).strip() for text in given)
    if not all(words) or not words:
        raise InputError("takes no value: write a list, as in XC330-M288-T,XW540-T140-R.", field=name)
    if len(set(words)) < len(words):
        raise InputError("takes a value twice.", field=name)
    return words


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
    robots = {}
    for values in product(*chosen.values()):
        robots[", ".join(values)] = apply_settings(description, dict(zip(chosen, values, strict=True)))
    return robots, rest

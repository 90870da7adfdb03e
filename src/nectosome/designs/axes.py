"""Axes of a sweep: quantities of a robot and the values that each of them takes."""

import re
from collections.abc import Sequence
from dataclasses import dataclass

from nectosome.description import RobotDescription, numeric_paths, resolve
from nectosome.units import InputError, shorten

_MOST = 100_000  # values of an axis
COUNT = "N"  # of flagella or segments: another structure for each value


@dataclass(frozen=True)
class SweepAxis:
    """Values [SI] that a quantity takes one after another."""

    name: str  # path or alias, or "N"
    values: tuple[float, ...]
    unit: str  # SI
    dimension: str


def read_axis(text: str, description: RobotDescription | None) -> SweepAxis:
    """Read `A=30:75:5deg` (from, to, step) or `A=30,45,75deg` (values); the unit of the last number counts for all.

    An axis over N needs no description. Raises InputError for what is neither, an unknown name, a value that its field
    does not allow, and a step that leads nowhere.
    """
    name, _, values = (part.strip() for part in text.partition("="))
    number = r"\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?\s*"
    match = re.fullmatch(rf"({number}(?::{number}:{number}|(?:,{number})*))([^\d,:].*)?", values)
    if not name or match is None:
        raise InputError(
            f'"{shorten(text)}" is no axis. Write a name, = and from:to:step or values, as in "A=30:75:5deg".',
            field="--over",
        )
    numbers = [float(x) for x in re.split("[:,]", match[1])]
    if ":" in match[1]:
        numbers = _steps(*numbers, name=name)
    if name == COUNT:
        return _count(numbers, match[2])
    if description is None:
        raise InputError("is no count of parts.", field=name)
    return axis(name, [f"{x!r} {match[2] or ''}".strip() for x in numbers], description)


def axis(name: str, values: Sequence[float | str], description: RobotDescription) -> SweepAxis:
    """Axis over a quantity at its path or alias; numbers are SI, text carries its unit. Raises InputError."""
    known = numeric_paths(description)
    paths = resolve(description, name)
    try:
        read = [[known[path].read(x, units_required=isinstance(x, str)) for path in paths] for x in values]
    except ValueError as error:
        raise InputError(str(error), field=name) from None
    found = tuple(row[0] for row in read)
    if not found:
        raise InputError("takes no value: at least one is needed.", field=name)
    if len(set(found)) < len(found):
        raise InputError("takes a value twice.", field=name)
    return SweepAxis(name, found, known[paths[0]].unit, known[paths[0]].dimension)


def _steps(start: float, stop: float, step: float, *, name: str) -> list[float]:
    """Values from start to stop, both included where the step leads there."""
    steps = (stop - start) / step if step else -1.0
    if not 0 <= steps < _MOST:
        raise InputError(
            f"{start:g}:{stop:g}:{step:g} leads nowhere, or is too fine. Write from:to:step, as in 30:75:5deg.",
            field=name,
        )
    # rounded, so that 0.3 + 6 x 0.1 is 0.9
    return [float(f"{start + k * step:.12g}") for k in range(int(steps + 1e-9) + 1)]


def _count(numbers: list[float], unit: str | None) -> SweepAxis:
    if unit or any(x != int(x) or x < 0 for x in numbers):
        raise InputError("is a count: whole numbers without a unit, as in N=1,2,3.", field=COUNT)
    return SweepAxis(COUNT, tuple(numbers), "1", "number")

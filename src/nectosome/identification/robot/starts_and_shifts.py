"""What each recording has of its own: the start of the robot's joints, and how late its readings are."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, apply_settings, get_value, numeric_paths, resolve
from nectosome.description.variables import Variable, read_range, read_variable
from nectosome.io.schema.quantity import Quantity
from nectosome.units import InputError, read_quantity, shorten
from nectosome.units.ranges import split_range

Span = str | Sequence[float]  # a range, or a number as text
SHIFT = "shift"
_READING = "reading"
_START = re.compile(r"(.+)\.joint\.(position|velocity|start\..+)")
_COORDINATES = "angle", "position"


class JointStart(NamedTuple):
    """How one coordinate of a joint, or its rate, starts in a recording."""

    paths: tuple[str, ...]
    value: Variable | float  # unknown within a range, or known [SI]
    how: str  # in words


def read_starts(
    given: Mapping[str, Span], described: RobotDescription, first: Mapping[str, float], trial: str
) -> tuple[RobotDescription, tuple[JointStart, ...]]:
    """The robot with the starts that are known, and all that are given: by path or alias of a joint's start.

    Each is a range `LOW..HIGH` of what is unknown, a number with its unit, or `reading`, the first reading of the
    column that measures it; `first` has these by the readings' names [SI]. Raises InputError that names the start.
    """
    found = []
    for name, span in given.items():
        paths = tuple(resolve(described, name))
        known = [_START.fullmatch(path) for path in paths]
        if not all(known):
            raise InputError(
                f'"{shorten(name)}" is no start of a joint. Name one, as in body.joint.position, body.joint.velocity, '
                "body.joint.start.position.0.",
                field="start",
            )
        if not isinstance(span, str) or split_range(span):
            variable = read_variable(name, span, described)
            _with_start(described, name, variable.upper)  # a joint that is moved has no start of its own
            found.append(JointStart(paths, replace(variable, name=f"{name} of {trial}"), f"{name} unknown"))
            continue
        if span.strip() == _READING:
            names = [one for match in known if match for one in _readings(*match.groups())]
            value = next((first[one] for one in names if one in first), np.nan)
            if not np.isfinite(value):
                raise InputError(
                    f"{name}: no first reading tells it. Compare {' or '.join(names) or 'its coordinate'} in a column "
                    "that has a first value, or give a number or a range.",
                    field="start",
                )
            described, how = _with_start(described, name, value), "first reading"
        else:
            described, how = apply_settings(described, [f"{name}={span}"]), "given"
        found.append(JointStart(paths, float(get_value(described, paths[0])), f"{name} {how}"))
    return described, tuple(found)


def _readings(part: str, what: str) -> list[str]:
    """Names of the readings that tell a start of a hinge or a slide; none for other joints."""
    ends = {"position": "", "velocity": ".rate"}
    return [f"{part.split('.')[-1]}.{one}{ends[what]}" for one in _COORDINATES] if what in ends else []


def _with_start(described: RobotDescription, name: str, value: float) -> RobotDescription:
    unit = numeric_paths(described)[resolve(described, name)[0]].unit
    return apply_settings(described, [f"{name}={value!r} {unit}"])


def read_shift(given: Span | float, name: str) -> Variable | float:
    """How late readings are [s]: unknown within the range `LOW..HIGH`, or known. Raises InputError."""
    if isinstance(given, int | float) or (isinstance(given, str) and not split_range(given)):
        return read_quantity(given, "time", SHIFT)
    try:
        return replace(read_range(SHIFT, given, [Quantity("time")]), name=name)
    except InputError as error:
        raise InputError(error.message, field=SHIFT) from None


def within(time: Float[np.ndarray, "n"], shift: Variable | float, driven: bool) -> Float[np.ndarray, "n"]:
    """Mask of the readings for which the robot's motion is known, whatever the shift in its range.

    None from before the robot's start; where it is driven by a column, none from after the end of that.
    """
    low, high = (shift.lower, shift.upper) if isinstance(shift, Variable) else (shift, shift)
    early = (time <= high) if high > 0 else np.zeros(time.shape, dtype=bool)
    late = (time - low > time[-1]) if driven else np.zeros(time.shape, dtype=bool)
    return ~(early | late)

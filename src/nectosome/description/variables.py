"""Variables: a quantity of a robot or of a mission by its name, and the range in which it may be chosen."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, WithJsonSchema

from nectosome.description.robot import RobotDescription, get_value, numeric_paths, resolve
from nectosome.io.schema.described import Text, unfit
from nectosome.io.schema.quantity import Quantity
from nectosome.units import InputError, format_quantity, shorten
from nectosome.units.ranges import Ranges, split_range


def _not_empty(ranges: dict[str, str]) -> dict[str, str]:
    if not ranges:
        raise unfit("needs at least one name with a range.")
    return ranges


_EXAMPLES = {"type": "string", "examples": ["300..700 mm", "1..9 MPa log"]}
RangesText = Annotated[dict[str, Annotated[Text, WithJsonSchema(_EXAMPLES)]], AfterValidator(_not_empty)]
"""Names of quantities, each with its range as text, in a file."""


@dataclass(frozen=True)
class Variable:
    """A quantity between two values [SI], on a linear or a logarithmic scale."""

    name: str  # path or alias of a robot's, or name of a mission's
    lower: float
    upper: float
    log: bool
    dimension: str

    def text(self) -> str:
        """Range as it is written in a problem file."""
        low, high = (format_quantity(x, self.dimension) for x in (self.lower, self.upper))
        return f"{low}..{high}{' log' if self.log else ''}"


def read_variable(name: str, span: str | Sequence[float], description: RobotDescription) -> Variable:
    """Read a range such as `1.4..1681MPa log`, or two numbers in SI.

    Raises InputError for an unknown name, a value that its field does not allow, an empty range, a logarithm of zero.
    """
    known = numeric_paths(description)
    return read_range(name, span, [known[path] for path in resolve(description, name)])


def read_range(name: str, span: str | Sequence[float], quantities: Sequence[Quantity]) -> Variable:
    """Read the range `LOW..HIGH` or `LOW..HIGH log`, or two numbers in SI, of one quantity or of several at once.

    A number without a unit has that of the next one. Raises InputError as `read_variable` does, and for a step: what
    varies takes any value of its range.
    """
    parts = split_range(span) if isinstance(span, str) else None
    ends = parts[:2] if parts else span
    if isinstance(ends, str) or len(ends) != 2:
        raise InputError(f'"{shorten(span)}" is no range. Write LOW..HIGH, as in "300..700mm".', field=name)
    if parts and parts.step:
        raise InputError(f'"{shorten(span)}" has a step, which only sweeps take. Write LOW..HIGH.', field=name)
    try:
        read = [[q.read(end, units_required=isinstance(end, str)) for end in ends] for q in quantities]
    except ValueError as error:
        raise InputError(str(error), field=name) from None
    lower, upper = read[0]
    if not lower < upper:
        raise InputError(f'"{shorten(span)}" is empty: its lower end must be less than its upper end.', field=name)
    log = parts is not None and parts.log
    if log and lower <= 0:
        raise InputError(f'"{shorten(span)}" has no logarithm: its lower end must be more than 0.', field=name)
    return Variable(name, lower, upper, log, quantities[0].dimension)


class Box(Ranges):
    """Variables together: from [0, 1]^n to their values and back."""

    def __init__(self, variables: tuple[Variable, ...]):
        names, lower, upper = ([getattr(v, of) for v in variables] for of in ("name", "lower", "upper"))
        super().__init__(names, lower, upper, [v.name for v in variables if v.log])

    def design(self, description: RobotDescription) -> Float[np.ndarray, "n"]:
        """Place of a robot in the box; outside of [0, 1] where the robot is outside of it."""
        return self.places(np.array([float(get_value(description, name)) for name in self.names]))

"""Variables: a quantity of a robot or of a mission by its name, and the range in which it may be chosen."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import AfterValidator, WithJsonSchema

from nectosome.description.robot import RobotDescription, get_value, numeric_paths, resolve
from nectosome.io.schema.described import Text, unfit
from nectosome.io.schema.quantity import Quantity, Uncertain
from nectosome.units import InputError, format_quantity, parse_quantity, shorten, split_unit
from nectosome.units.ranges import Ranges, RangeText, split_range

_MOST = 100_000  # values of a range with a step


def _not_empty(ranges: dict[str, str]) -> dict[str, str]:
    if not ranges:
        raise unfit("needs at least one name with a range.")
    return ranges


_EXAMPLES = {"type": "string", "examples": ["300..700 mm", "1..9 MPa log"]}
RangesText = Annotated[dict[str, Annotated[Text, WithJsonSchema(_EXAMPLES)]], AfterValidator(_not_empty)]
"""Names of quantities, each with its range as text, in a file."""


@dataclass(frozen=True)
class Variable:
    """A quantity between two values [SI], on a linear or a logarithmic scale.

    - levels: how many values it takes, evenly on its scale; 0 for one that takes all.
    """

    name: str  # path or alias of a robot's, or name of a mission's
    lower: float
    upper: float
    log: bool
    dimension: str
    levels: int = 0

    def text(self) -> str:
        """Range as it is written in a problem file."""
        low, high = (format_quantity(x, self.dimension) for x in (self.lower, self.upper))
        return f"{low}..{high}{self._step}{' log' if self.log else ''}"

    @property
    def _step(self) -> str:
        if not self.levels:
            return ""
        if self.log:
            return f":{(self.upper / self.lower) ** (1 / (self.levels - 1)):.12g}"
        step = (self.upper - self.lower) / (self.levels - 1)
        return f":{format_quantity(float(f'{step:.12g}'), self.dimension)}"


def read_variable(
    name: str, span: str | Sequence[float], description: RobotDescription, *, steps: bool = False
) -> Variable:
    """Read a range such as `1.4..1681MPa log`, or two numbers in SI; with `steps` also one with a step, `2..6mm:0.5mm`.

    Raises InputError for an unknown name, a value that its field does not allow, an empty range, a logarithm of zero.
    """
    known = numeric_paths(description)
    return read_range(name, span, [known[path] for path in resolve(description, name)], steps=steps)


def read_range(
    name: str, span: str | Sequence[float], quantities: Sequence[Quantity], *, steps: bool = False
) -> Variable:
    """Read the range `LOW..HIGH` or `LOW..HIGH log`, or two numbers in SI, of one quantity or of several at once.

    A number without a unit has that of the next one. Raises InputError as `read_variable` does, and for a step unless
    `steps` allows it: what varies takes any value of its range.
    """
    parts = split_range(span) if isinstance(span, str) else None
    ends = parts[:2] if parts else span
    if isinstance(ends, str) or len(ends) != 2:
        raise InputError(f'"{shorten(span)}" is no range. Write LOW..HIGH, as in "300..700mm".', field=name)
    if parts and parts.step and not steps:
        words = "has a step, which only sweeps and designs of a motion take. Write LOW..HIGH."
        raise InputError(f'"{shorten(span)}" {words}', field=name)
    levels = 0
    try:
        if parts and parts.step:
            values = values_in_steps(parts, quantities[0])
            ends, levels = (values[0], values[-1]), len(values)
        read = [[q.read(end, units_required=isinstance(end, str)) for end in ends] for q in quantities]
    except ValueError as error:
        raise InputError(str(error), field=name) from None
    lower, upper = read[0]
    if isinstance(lower, Uncertain) or isinstance(upper, Uncertain):
        raise InputError(f'"{shorten(span)}" has a +-, which the ends of a range have not. Leave it out.', field=name)
    if not lower < upper:
        raise InputError(f'"{shorten(span)}" is empty: its lower end must be less than its upper end.', field=name)
    log = parts is not None and parts.log
    if log and lower <= 0:
        raise InputError(f'"{shorten(span)}" has no logarithm: its lower end must be more than 0.', field=name)
    return Variable(name, lower, upper, log, quantities[0].dimension, levels)


def values_in_steps(parts: RangeText, quantity: Quantity) -> list[str]:
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


class Box(Ranges):
    """Variables together: from [0, 1]^n to their values and back."""

    def __init__(self, variables: tuple[Variable, ...]):
        names, lower, upper = ([getattr(v, of) for v in variables] for of in ("name", "lower", "upper"))
        super().__init__(names, lower, upper, [v.name for v in variables if v.log])
        self._stepped = np.array([v.levels > 0 for v in variables])

    def values(self, u: Float[np.ndarray, "*m n"]) -> Float[np.ndarray, "*m n"]:
        """Values at coordinates, as `Ranges` has them; without rounding in the last digits where they are in steps."""
        x = super().values(u)
        if not self._stepped.any():
            return x
        digits = 10.0 ** (11 - np.floor(np.log10(np.where(x == 0, 1.0, np.abs(x)))))
        return np.where(self._stepped, np.rint(x * digits) / digits, x)

    def design(self, description: RobotDescription) -> Float[np.ndarray, "n"]:
        """Place of a robot in the box; outside of [0, 1] where the robot is outside of it."""
        return self.places(np.array([float(get_value(description, name)) for name in self.names]))


def chosen_values(description: RobotDescription, values: Mapping[str, float]) -> dict[str, float]:
    """Values by path of quantities that are chosen [SI]; a number with +- keeps its spread (`Quantity.scales`)."""
    found = {path: x for name, x in values.items() for path in resolve(description, name)}
    own = {path: get_value(description, path) for path in found}
    uncertain = {path: value for path, value in own.items() if isinstance(value, Uncertain)}
    known = numeric_paths(description) if uncertain else {}
    for path, value in uncertain.items():
        ratio = found[path] / value if known[path].scales(value) else 1.0
        found[path] = Uncertain(found[path], value.plus_minus * ratio, value.each)
    return found

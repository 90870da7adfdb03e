"""Which numbers of a robot have a slider, in which unit, and from where to where."""

import math
from collections.abc import Mapping
from typing import NamedTuple

from nectosome.description import RobotDescription, get_value, numeric_paths, resolve
from nectosome.description.variables import Variable, read_variable
from nectosome.designs.problem import RangeLike
from nectosome.units import show_quantity, unit_to_si

_STEPS = 300  # of a slider at least
_MEETS = 1e-6  # of a step
_AROUND = 2.0  # a quantity without a range: from its half to its double
_ROOM = 6  # characters of the field beside a slider
_LOG_AROUND = 4.0  # of a logarithmic range that is shown at once: up and down by this factor


class SliderScale(NamedTuple):
    """A slider in a unit that people read: `factor` [SI] times what it shows is the value."""

    name: str  # path or alias
    unit: str
    factor: float
    low: float
    high: float
    step: float

    @property
    def label(self) -> str:
        """Name and unit, as they stand beside the slider."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def beyond(self, value: float) -> str:
        """What to say of a robot's value [SI] that the slider cannot show; empty where it can, to a step."""
        own = value / self.factor
        if self.low - self.step < own < self.high + self.step:
            return ""
        unit = f" {self.unit}" if self.unit else ""
        span = f"{self.low:g} to {self.high:g}{unit}"
        return f"{self.name} is {own:.6g}{unit}, beyond its slider ({span}). The robot keeps it until that is moved."

    def shown(self, value: float) -> float:
        """Value [SI] in the slider's unit, within its range, with one decimal more than its step has where it fits."""
        within, decimals = min(max(value / self.factor, self.low), self.high), -math.floor(math.log10(self.step))
        fine = round(within, decimals + 1)
        return fine if len(f"{fine:.10g}") <= _ROOM else round(within, decimals)


def scales_of(description: RobotDescription, ranges: Mapping[str, RangeLike]) -> list[SliderScale]:
    """Sliders for what has a range, such as `1.4..1681MPa log`, and for all that has a short name of its own."""
    given = [read_variable(name, span, description) for name, span in ranges.items()]
    taken = {path for v in given for path in resolve(description, v.name)}
    own = (around(description, alias) for alias, paths in description.number_aliases.items() if not taken & set(paths))
    return [_scale_of(description, v, not v.log) for v in given] + [_scale_of(description, v, False) for v in own if v]


def around(description: RobotDescription, name: str) -> Variable | None:
    """From half to double of a quantity, within what its field allows; None where that is no range, as of 0.

    Raises InputError for an unknown name.
    """
    value, q = _value(description, name), numeric_paths(description)[resolve(description, name)[0]]
    low, high = sorted((value / _AROUND, value * _AROUND))
    least = -math.inf if q.minimum is None else q.minimum
    most = math.inf if q.maximum is None else q.maximum
    return Variable(name, max(low, least), min(high, most), False, q.dimension) if value else None


def _scale_of(description: RobotDescription, v: Variable, to_the_ends: bool) -> SliderScale:
    """Slider of a range. Of a logarithmic one it shows what is near to the robot's value."""
    value = _value(description, v.name) or v.lower
    low, high = v.lower, v.upper
    if v.log:
        low, high = max(low, value / _LOG_AROUND), min(high, value * _LOG_AROUND)
    unit = show_quantity(min(max(value, low), high), v.dimension).partition(" ")[2]
    factor = unit_to_si(unit)[0] if unit else 1.0
    return SliderScale(v.name, unit, factor, *_ends_and_step(low / factor, high / factor, to_the_ends))


def _value(description: RobotDescription, name: str) -> float:
    """Value [SI] of a name; 0 where the values of its paths differ: one slider could not show them."""
    values = {float(get_value(description, path)) for path in resolve(description, name)}
    return values.pop() if len(values) == 1 else 0.0


def _ends_and_step(low: float, high: float, to_the_ends: bool) -> tuple[float, float, float]:
    """Ends and step of a slider, a step that people count in; `to_the_ends` asks for one that meets both ends.

    Where it meets an end not, the slider ends within the range, by less than a step: beyond it may not be allowed.
    """
    finest = (high - low) / _STEPS
    digits = math.floor(math.log10(finest))
    steps = [m * 10.0**k for k in range(digits, digits - 3, -1) for m in (5, 2, 1) if m * 10.0**k <= finest]
    met = (step for step in steps if all(abs(x / step - round(x / step)) < _MEETS for x in (low, high)))
    step = next(met, steps[0]) if to_the_ends else steps[0]
    first, last = (f(x / step + sign * _MEETS) for f, x, sign in ((math.ceil, low, -1), (math.floor, high, 1)))
    return tuple(float(f"{x:.10g}") for x in (first * step, last * step, step))  # type: ignore[return-value]

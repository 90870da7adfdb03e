"""Commands of a controller: the quantity that it sets, and its range."""

import re
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float

from nectosome.description import RobotDescription, get_value, numeric_paths, resolve
from nectosome.units import InputError, shorten, unit_to_si
from nectosome.units.ranges import with_last_unit

from .beat import Beat, beat_of


class CommandRange(NamedTuple):
    """A quantity of a robot that a controller sets, its range in SI, and the unit in which that was written."""

    name: str
    paths: tuple[str, ...]
    low: float
    high: float
    initial: float  # value in the description
    dimension: str
    unit: str
    unit_size: float

    @classmethod
    def parse(cls, text: str, description: RobotDescription) -> "CommandRange":
        """Range such as `bias=-8..8 mN m`; the unit of the last number counts for both. Raises InputError."""
        name, _, rest = (part.strip() for part in text.partition("="))
        low, _, high = (part.strip() for part in rest.partition(".."))
        if not (name and low and high):
            hint = 'Write PATH=LOW..HIGH, as in "bias=-8..8 mN m".'
            raise InputError(f'"{shorten(text)}" has no range. {hint}', field="command")
        try:
            paths = tuple(resolve(description, name))
        except InputError as error:
            aliases = f" Aliases: {', '.join(description.number_aliases)}." if description.number_aliases else ""
            raise InputError(error.message + aliases, field="command") from None
        unit = unit_text(high)
        quantity = numeric_paths(description)[paths[0]]
        try:
            ends = [quantity.read(end, units_required=True) for end in with_last_unit([low, high])]
        except ValueError as error:
            raise InputError(str(error), field=f"command {name}") from None
        initial = float(get_value(description, name))
        size = unit_to_si(unit)[0] if unit else 1.0
        command = cls(name, paths, ends[0], ends[1], initial, quantity.dimension, unit or quantity.unit, size)
        if not command.low < command.high:
            raise InputError(f"{low}..{high} is empty. Write the smaller end first.", field=f"command {name}")
        if not command.low <= initial <= command.high:
            ends_shown = f"{command.show(command.low)} to {command.show(command.high)}"
            message = f"it starts at {command.show(initial)}, outside of {ends_shown}."
            raise InputError(f"{message} Put it inside first, or widen the range.", field=f"command {name}")
        return command

    @property
    def largest(self) -> float:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))

    def beat(self, description: RobotDescription, required: bool) -> Beat | None:
        """Beat of the robot under this command; None where it has none. Raises InputError where one is required."""
        try:
            beat = beat_of(description, self.paths, self.initial)
        except InputError as error:
            if required:
                place = f"{error.field}: " if error.field and "." in error.field else ""
                raise InputError(f"there is no beat to average over: {place}{error.message}", field="mean") from None
            return None
        if required and beat.nominal and self.low <= 0:
            message = f"a beat never ends at {self.show(0.0)}. Let the range begin above that."
            raise InputError(message, field=f"command {self.name}")
        return beat

    def at_limits(self, command: Float[np.ndarray, "k"]) -> Bool[np.ndarray, "k"]:
        """Whether each command is at an end of the range."""
        return np.isclose(command, self.low) | np.isclose(command, self.high)

    def show(self, value: float) -> str:
        """A value in the unit in which the range was written."""
        return f"{value / self.unit_size:.4g} {self.unit}".strip()


def unit_text(text: str) -> str:
    """The unit behind a number, as it is written."""
    return re.sub(r"^\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", "", text).strip()

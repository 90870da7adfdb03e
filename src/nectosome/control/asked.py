"""What a controller of a robot is asked for, in words: the range of its command, and a reference."""

import re
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.io import (
    InputError,
    RobotDescription,
    did_you_mean,
    get_value,
    numeric_paths,
    resolve,
)
from nectosome.io.asked import read_quantity
from nectosome.io.dimensions import DIMENSIONS
from nectosome.io.errors import shorten
from nectosome.io.units import unit_to_si

from .beat import Beat, beat_of
from .references import sine, times, triangle

SHAPES = ("sine", "triangle")


class Range(NamedTuple):
    """What the command may be, SI, and the unit in which that was written."""

    name: str
    paths: tuple[str, ...]
    low: float
    high: float
    resting: float
    dimension: str
    unit: str
    unit_size: float

    @property
    def largest(self) -> float:
        """Largest magnitude."""
        return max(abs(self.low), abs(self.high))

    def show(self, value: float) -> str:
        """A value in the unit in which it was written."""
        return f"{value / self.unit_size:.4g} {self.unit}".strip()


def read_range(text: str, description: RobotDescription) -> Range:
    """Read `bias=-8:8mN m`; the unit of the last number counts for both. Raises InputError."""
    name, equals, rest = (part.strip() for part in text.partition("="))
    low, colon, high = (part.strip() for part in rest.partition(":"))
    if not (name and equals and low and colon and high):
        message = f'"{shorten(text)}" has no range. Write PATH=LOW:HIGH, as in "bias=-8:8mN m".'
        raise InputError(message, field="command")
    try:
        paths = tuple(resolve(description, name))
    except InputError as error:
        aliases = f" Aliases: {', '.join(description.aliases)}." if description.aliases else ""
        raise InputError(error.message + aliases, field="command") from None
    unit = _unit_of(high)
    quantity = numeric_paths(description)[paths[0]]
    texts = [low if _unit_of(low) else f"{low} {unit}".strip(), high]
    try:
        ends = [quantity.read(end, units_required=True) for end in texts]
    except ValueError as error:
        raise InputError(str(error), field=f"command {name}") from None
    resting = float(get_value(description, name))
    size = unit_to_si(unit)[0] if unit else 1.0
    found = Range(name, paths, ends[0], ends[1], resting, quantity.dimension, unit or quantity.unit, size)
    if not found.low < found.high:
        message = f"{low}:{high} is empty. Write the smaller end first."
        raise InputError(message, field=f"command {name}")
    if not found.low <= resting <= found.high:
        message = f"it starts at {found.show(resting)}, outside of {found.show(found.low)} to {found.show(found.high)}."
        raise InputError(f"{message} Put it inside first, or widen the range.", field=f"command {name}")
    return found


def read_beat(description: RobotDescription, reach: Range, mean: bool) -> Beat | None:
    """The beat of the robot; None without one, where its mean is not asked for. Raises InputError."""
    try:
        beat = beat_of(description, reach.paths, reach.resting)
    except InputError as error:
        if mean:
            told = f"{error.field}: " if error.field and "." in error.field else ""
            raise InputError(f"there is no beat to take it of: {told}{error.message}", field="mean") from None
        return None
    if mean and beat.follows and reach.low <= 0:
        message = f"a beat never ends at {reach.show(0.0)}. Let the range begin above that."
        raise InputError(message, field=f"command {reach.name}")
    return beat


class Wanted(NamedTuple):
    """A reference as it was asked for, SI, and the unit in which that was written."""

    kind: str
    size: float
    dimension: str
    unit: str
    unit_size: float

    @classmethod
    def read(cls, reference: str, amplitude: str | None, dimension: str) -> "Wanted":
        """Raises InputError."""
        text, option = (reference, "reference") if amplitude is None else (amplitude, "amplitude")
        if amplitude is None and not re.match(r"\s*[-+.\d]", reference):
            message = f'"{shorten(reference)}" is no reference: a quantity, sine or triangle.'
            raise InputError(message + did_you_mean(reference, SHAPES), field=option)
        size = read_quantity(text, dimension, option)
        if amplitude is not None and size <= 0:
            raise InputError(f'"{amplitude}" is out of range: it must be more than 0.', field=option)
        unit = _unit_of(text)
        size_of_unit = unit_to_si(unit)[0] if unit else 1.0
        kind = "constant" if amplitude is None else reference
        return cls(kind, size, dimension, unit or DIMENSIONS[dimension].unit, size_of_unit)

    def samples(self, start: float, turns: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
        """At even times; what goes to and fro does so about where the robot starts."""
        if self.kind == "constant":
            return np.full(times(time, dt).size, self.size)
        return start + (sine if self.kind == "sine" else triangle)(self.size, turns, time, dt)

    def show(self, value: float) -> str:
        """A value in the unit in which it was written."""
        return f"{value / self.unit_size:.4g} {self.unit}".strip()


def _unit_of(text: str) -> str:
    """What stands behind a number."""
    return re.sub(r"^\s*[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", "", text).strip()

"""Where the output should be: references as samples, from t = 0 on."""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, get_value, numeric_paths, resolve
from nectosome.units import DIMENSIONS, InputError, did_you_mean, read_quantity, shorten, unit_to_si

from .beat import Beat, beat_of


def sine(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """amplitude sin(2 pi frequency t), `time` [s] long."""
    return amplitude * np.sin(2 * np.pi * frequency * times(time, dt))


def triangle(amplitude: float, frequency: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """Straight to amplitude, to -amplitude and back to 0, over and over."""
    return amplitude * (2 / np.pi) * np.arcsin(np.sin(2 * np.pi * frequency * times(time, dt)))


def varying(amplitudes: Sequence[float], frequencies: Sequence[float], dt: float) -> Float[np.ndarray, "n"]:
    """One period of each sine after the other: its rate jumps between them.

    Raises InputError where there are not as many amplitudes as frequencies.
    """
    if len(amplitudes) != len(frequencies) or not amplitudes:
        raise InputError(f"{len(amplitudes)} amplitudes and {len(frequencies)} frequencies; as many are needed.")
    ends = np.concatenate([[0.0], np.cumsum(1 / np.asarray(frequencies, dtype=float))])
    t = times(float(ends[-1]), dt)
    k = np.clip(np.searchsorted(ends, t, side="right") - 1, 0, len(amplitudes) - 1)
    return np.asarray(amplitudes)[k] * np.sin(2 * np.pi * np.asarray(frequencies)[k] * (t - ends[k]))


def chirp(amplitude: float, first: float, last: float, time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A sine whose frequency grows evenly on a logarithmic scale, from `first` to `last` [Hz]."""
    t, growth = times(time, dt), np.log(last / first) / time
    turns = first * t if growth == 0 else first * np.expm1(growth * t) / growth
    return amplitude * np.sin(2 * np.pi * turns)


def eased(reference: Float[np.ndarray, "n"], time: float, dt: float) -> Float[np.ndarray, "n"]:
    """A reference that grows from 0 within `time` [s], by s^2 (3 - 2 s), so that its rate does not jump at first.

    Raises InputError for no time.
    """
    if not time > 0:
        raise InputError(f"{time:g} s are no time to grow in.", field="time")
    s = np.minimum(np.arange(len(reference)) * dt / time, 1.0)
    return reference * s**2 * (3 - 2 * s)


def times(time: float, dt: float) -> Float[np.ndarray, "n"]:
    """0, dt, ... up to `time` [s]."""
    return np.arange(int(time / dt + 1e-6) + 1) * dt


def local_frequency(reference: Float[np.ndarray, "n"], dt: float) -> Float[np.ndarray, "n"]:
    """Frequency [Hz] at each sample: half a wave lies between turns; before the first and after the last as beside it.

    0 throughout where the reference does not turn twice.
    """
    ways = np.sign(np.diff(reference))
    moving = np.flatnonzero(ways)
    turns = moving[1:][np.diff(ways[moving]) != 0] * dt
    if len(turns) < 2:
        return np.zeros(len(reference))
    each = 0.5 / np.diff(turns)
    k = np.searchsorted(turns, np.arange(len(reference)) * dt, side="right") - 1
    return each[np.clip(k, 0, len(each) - 1)]


SHAPES = ("sine", "triangle")


class CommandRange(NamedTuple):
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


def read_range(text: str, description: RobotDescription) -> CommandRange:
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
    found = CommandRange(name, paths, ends[0], ends[1], resting, quantity.dimension, unit or quantity.unit, size)
    if not found.low < found.high:
        message = f"{low}:{high} is empty. Write the smaller end first."
        raise InputError(message, field=f"command {name}")
    if not found.low <= resting <= found.high:
        message = f"it starts at {found.show(resting)}, outside of {found.show(found.low)} to {found.show(found.high)}."
        raise InputError(f"{message} Put it inside first, or widen the range.", field=f"command {name}")
    return found


def read_beat(description: RobotDescription, reach: CommandRange, mean: bool) -> Beat | None:
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


class Reference(NamedTuple):
    """A reference as it was asked for, SI, and the unit in which that was written."""

    kind: str
    size: float
    dimension: str
    unit: str
    unit_size: float

    @classmethod
    def read(cls, reference: str, amplitude: str | None, dimension: str) -> "Reference":
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

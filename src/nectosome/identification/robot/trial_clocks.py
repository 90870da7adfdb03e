r"""Clocks of what was read: late by a shift and fast by a drift, known or unknown.

Where the clock behind it reads T, a clock that is late by $s$ and fast by the share $d$ reads

$$ t = (1 + d)\, T + s $$

The clock of a device has that of the recording behind it, and this one that of the robot and its inputs.
"""

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Bool, Float
from pydantic_core import PydanticCustomError

from nectosome.description.variables import Variable
from nectosome.measure.sheet_values import read_drift, read_shift
from nectosome.units import InputError

Span = str | Sequence[float]  # a range, or a number as text
SHIFT, DRIFT = "shift", "drift"


class TrialClock(NamedTuple):
    """A clock of some columns of a recording, by their places."""

    name: str  # empty of the recording's own
    columns: tuple[int, ...]
    shift: Variable | float = 0.0  # [s]
    drift: Variable | float = 0.0

    @property
    def unknown(self) -> tuple[Variable, ...]:
        """Its shift and its drift where they are unknown."""
        return tuple(one for one in (self.shift, self.drift) if isinstance(one, Variable))

    def known(self, values: Mapping[str, float]) -> "TrialClock":
        """The same with these values of what is unknown, by name."""
        late = self.shift, self.drift
        shift, drift = (values.get(x.name, x) if isinstance(x, Variable) else x for x in late)
        return self._replace(shift=shift, drift=drift)


def read_lateness(given: Span | float, what: str, name: str) -> Variable | float:
    """A shift [s] or a drift, as sheets have them: unknown within a range, or known. Raises InputError."""
    if isinstance(given, int | float):
        return float(given)
    read, dimension = (read_shift, "time") if what == SHIFT else (read_drift, "number")
    try:
        late = read(given if isinstance(given, str) else [x if isinstance(x, str) else float(x) for x in given])
    except PydanticCustomError as error:
        raise InputError(error.message(), field=what) from None
    return late if isinstance(late, float) else Variable(name, late[0], late[1], False, dimension)


def robot_times(
    clocks: Sequence[TrialClock], time: Float[np.ndarray, "k n"], values: Mapping[str, float]
) -> Float[np.ndarray, "k n"]:
    """Times of the robot at which columns were read at `time`."""
    return [time, *(after for after, _ in _chain(clocks, time, values))][-1]


def time_derivatives(
    clocks: Sequence[TrialClock], time: Float[np.ndarray, "k n"], values: Mapping[str, float], name: str
) -> Float[np.ndarray, "k n"]:
    """Derivatives of these times by what is called `name`."""
    found = np.zeros(time.shape)
    for clock, (after, drift) in zip(clocks, _chain(clocks, time, values), strict=True):
        rows, by = list(clock.columns), np.zeros(time.shape)
        for one, derivative in ((clock.shift, -1.0), (clock.drift, -after)):
            if isinstance(one, Variable) and one.name == name:
                by = by + derivative
        found[rows] = (found + by)[rows] / (1 + drift)
    return found


def _chain(
    clocks: Sequence[TrialClock], time: Float[np.ndarray, "k n"], values: Mapping[str, float]
) -> Iterator[tuple[Float[np.ndarray, "k n"], float]]:
    """Times of what is behind each clock, and its drift."""
    for clock in clocks:
        late = clock.shift, clock.drift
        shift, drift = (values[x.name] if isinstance(x, Variable) else x for x in late)
        rows, time = list(clock.columns), time.copy()
        time[rows] = (time[rows] - shift) / (1 + drift)
        yield time, drift


def is_within(clocks: Sequence[TrialClock], time: Float[np.ndarray, "k n"], driven: bool) -> Bool[np.ndarray, "k n"]:
    """Mask of the readings for which the robot's motion is known, whatever is unknown of clocks in its range.

    None from before the robot's start; where it is driven by a column, none from after the end of that.
    """
    unknown = [one for clock in clocks for one in clock.unknown]
    first = robot_times(clocks, time, {one.name: one.upper for one in unknown})
    last = robot_times(clocks, time, {one.name: one.lower for one in unknown})
    early = (first < 0) | ((first == 0) & (time > 0))
    return ~(early | ((last > time.max()) & driven))

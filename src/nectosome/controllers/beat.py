"""The beat of a swimmer, and means over one of it: what oscillates with the beat is gone, what drifts is left."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, numeric_paths, with_values
from nectosome.description.period import drive_frequencies, drive_period

_SAME = 1e-9  # of a beat, by which rounding may move its begin
_LEAST = 64  # moments of a beat that its mean is taken of


class Beat(NamedTuple):
    """How often the drives of a robot repeat themselves."""

    frequency: float  # [Hz], with the command as the description has it
    follows: float  # that command, where the beat goes with it; 0 where it does not

    def at(self, command: float) -> float:
        """Frequency [Hz] under a command."""
        return self.frequency * abs(command / self.follows) if self.follows else self.frequency


def beat_of(description: RobotDescription, commanded: Sequence[str], resting: float) -> Beat:
    """Beat of a robot whose numbers at some paths are commanded; how its strokes begin does not matter.

    Where a command changes the frequency of some drives only, the beat is that of the rest. Raises InputError where
    nothing beats, and where drives have no common period.
    """
    ramps = {path: 0.0 for path in numeric_paths(description) if path.endswith(".ramp")}
    begun = with_values(description, ramps)
    drives = set(drive_frequencies(begun))
    led = drives & set(commanded)
    if led == drives:
        return Beat(1 / drive_period(begun), resting if led else 0.0)
    return Beat(1 / drive_period(with_values(begun, dict.fromkeys(led, 0.0))), 0.0)


def moments_of(beat: Beat, fastest: float, dt: float) -> int:
    """How many even moments of a sample dt [s] long are needed for means over beats, with that command the fastest."""
    return max(1, int(np.ceil(_LEAST * dt * beat.at(fastest) - 1e-9)))


class BeatMean:
    r"""Mean over the last beat, $\int_{\phi - 1}^{\phi} y\,d\phi$ with the beats $\phi$ that have passed,
    of a quantity that comes in piece by piece.

    What the beat makes oscillate vanishes, what drifts at an even rate is told as it was half a beat ago. All parts of
    a stroke count alike, also where the command changes how fast they are gone through. The integral is that of the
    trapezoidal rule: exact, for what a beat repeats, where a beat is a whole number of even moments, and for drifts.
    Before the quantity began to come in it counts as what it was at first.
    """

    def __init__(self, beat: Beat, value: float):
        self._beat, self._time = beat, 0.0
        self._passed, self._value = np.array([[-1.0, 0.0], [value, value]])

    def add(self, time: Float[np.ndarray, "m"], value: Float[np.ndarray, "m"], command: float) -> None:
        """Moments after those before, [s] and the quantity, under a command."""
        passed = np.append(self._passed, self._passed[-1] + self._beat.at(command) * (time - self._time))
        first = max(int(np.searchsorted(passed, passed[-1] - 1.0)) - 1, 0)  # what lies a beat back is over
        self._time = float(time[-1])
        self._passed, self._value = passed[first:], np.append(self._value, value)[first:]

    def mean(self) -> float:
        """Up to the last moment."""
        since = self._passed[-1] - 1.0
        after = self._passed > since + _SAME
        passed = np.append(since, self._passed[after])
        value = np.append(np.interp(since, self._passed, self._value), self._value[after])
        return float(np.trapezoid(value, passed))

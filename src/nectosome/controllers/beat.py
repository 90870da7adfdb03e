"""The beat of a swimmer, and means over one beat, which remove its oscillation and keep its drift."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import equinox as eqx
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, ArrayLike, Float

from nectosome.description import RobotDescription, with_values
from nectosome.description.period import drive_frequencies, drive_period
from nectosome.units import InputError

from .block_loop import BlockLoopRecord
from .contract import Controller, Regulator

_ROUNDING = 1e-9  # of a beat, by which rounding may move its start
_LEAST = 64  # instants of a beat, for its mean
_FEWEST = 4  # samples of a beat, for its mean from samples alone


class Beat(NamedTuple):
    """Common frequency of the drives of a robot, which may be proportional to the command."""

    frequency: float  # [Hz], with the command as the description has it
    nominal: float  # that command, where the frequency is proportional to the command; else 0

    def at(self, command: float) -> float:
        """Frequency [Hz] under a command."""
        return self.frequency * abs(command / self.nominal) if self.nominal else self.frequency


def beat_of(description: RobotDescription, paths: Sequence[str], nominal: float) -> Beat:
    """Beat of a robot whose quantities at some paths are commanded.

    `nominal` is the value of the command in the description. Where a command changes the frequency of some drives
    only, the beat is that of the others. Raises InputError where no drive is periodic, and where drives have no common
    period.
    """
    drives = set(drive_frequencies(description))
    commanded = drives & set(paths)
    if commanded == drives:
        return Beat(1 / drive_period(description), nominal if commanded else 0.0)
    return Beat(1 / drive_period(with_values(description, dict.fromkeys(commanded, 0.0))), 0.0)


def instants_per_sample(beat: Beat, fastest: float, dt: float) -> int:
    """Even instants of a hold interval dt [s] long that means over a beat need, with `fastest` the largest command."""
    return max(1, int(np.ceil(_LEAST * dt * beat.at(fastest) - 1e-9)))


class BeatMean:
    r"""Mean over the last beat of a quantity, $\int_{\phi - 1}^{\phi} y\,d\phi$ with the number of beats $\phi$ so far.

    It removes the oscillation with the beat and delays a steady drift by half a beat. All phases of a stroke have the
    same weight, also where the command changes the frequency. Trapezoidal rule: exact for a periodic quantity where a
    beat is a whole number of even instants, and for a linear drift. Before the first instant the quantity counts as
    constant.
    """

    def __init__(self, beat: Beat, value: float):
        self._beat, self._time = beat, 0.0
        self._phase, self._value = np.array([[-1.0, 0.0], [value, value]])

    @classmethod
    def of_samples(cls, beat: Beat, values: Float[np.ndarray, "k"], dt: float) -> Float[np.ndarray, "k"]:
        """The mean at each of some samples dt [s] apart, for a beat that no command changes."""
        mean, means = cls(beat, float(values[0])), [float(values[0])]
        for k, value in enumerate(values[1:], start=1):
            mean.add(np.array([k * dt]), np.array([value]), 0.0)
            means.append(mean.mean())
        return np.array(means)

    def add(self, time: Float[np.ndarray, "m"], value: Float[np.ndarray, "m"], command: float) -> None:
        """Append instants [s], later than those before, and the quantity there, under a command."""
        phase = np.append(self._phase, self._phase[-1] + self._beat.at(command) * (time - self._time))
        first = max(int(np.searchsorted(phase, phase[-1] - 1.0)) - 1, 0)
        self._time = float(time[-1])
        self._phase, self._value = phase[first:], np.append(self._value, value)[first:]

    def mean(self) -> float:
        """Mean over the beat that ends at the last instant."""
        start = self._phase[-1] - 1.0
        after = self._phase > start + _ROUNDING
        phase = np.append(start, self._phase[after])
        value = np.append(np.interp(start, self._phase, self._value), self._value[after])
        return float(np.trapezoid(value, phase))


class BeatAveraged(Controller):
    """A controller of the mean over the last beat, from samples alone, as a rig has them: see `BeatMean`.

    Straight lines between samples; the beat does not change. Where it is a whole number of samples, all harmonics
    vanish but those of the sampling rate. Before the first sample the measurement counts as constant.
    """

    inner: Controller
    frequency: float = eqx.field(static=True)  # [Hz]

    def planned(self, reference: Float[np.ndarray, "n"], dt: float) -> Regulator:
        """The inner controller behind the mean. Raises InputError for a beat shorter than four samples."""
        beat = 1 / (self.frequency * dt)
        if beat < _FEWEST:
            message = f"a beat takes {beat:.3g} samples, {_FEWEST} or more are needed for its mean."
            raise InputError(message, field="mean")
        whole = int(beat + _ROUNDING)
        share = max(beat - whole, 0.0)  # of the oldest interval
        weights = np.zeros(whole + 2)
        weights[1:] = 1.0
        weights[1] = weights[-1] = 0.5
        weights[:2] += share * np.array([0.5 * share, 1 - 0.5 * share])
        return _AveragedRegulator(self.inner.planned(reference, dt), jnp.asarray(weights / beat))

    def after(self, record: Any, dt: float) -> "BeatAveraged":
        """That of the inner controller, after the means of the measurements."""
        means = BeatMean.of_samples(Beat(self.frequency, 0.0), np.asarray(record.measured), dt)
        averaged = BlockLoopRecord(record.reference, record.output, jnp.asarray(means), record.command)
        return BeatAveraged(self.inner.after(averaged, dt), self.frequency)


class _AveragedRegulator(Regulator):
    """A regulator of a weighted sum of the last measurements, the present one last."""

    inner: Regulator
    weights: Float[Array, "m"]

    def initial(self, command: Float[ArrayLike, ""] = 0.0, measured: Float[ArrayLike, ""] = 0.0) -> Any:
        """As if it had always been measured."""
        return self.inner.initial(command, measured), jnp.full(self.weights.shape, measured)

    def step(self, state: Any, measured: Float[Array, ""]) -> tuple[Any, Float[Array, ""]]:
        """One sample of the inner regulator, with the mean."""
        inner, before = state
        last = jnp.append(before[1:], measured)
        inner, command = self.inner.step(inner, self.weights @ last)
        return (inner, last), command

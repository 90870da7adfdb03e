"""Signals that a plan plays on commands, in their fields and as functions of time; a list of values is an axis."""

from abc import abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from jaxtyping import Float
from pydantic import Field

from nectosome.controllers.references import chirp_turns, recorded_reference
from nectosome.description.fields import Angle, Number, PositiveFrequency
from nectosome.io.schema.described import Described, OneOrMany
from nectosome.units import DIMENSIONS, InputError, dimension_of

from .channel_units import AnyQuantity, same_unit

Time = Float[np.ndarray, "n"]  # [s], from the beginning of the signal; less than 0 while it grows
Wave = Callable[[Time], Float[np.ndarray, "n"]]

_Several = Annotated[tuple[AnyQuantity, ...], Field(min_length=1), OneOrMany()]
_Frequencies = Annotated[tuple[PositiveFrequency, ...], Field(min_length=1), OneOrMany()]
_Angles = Annotated[tuple[Angle, ...], Field(min_length=1), OneOrMany()]
_Numbers = Annotated[tuple[Number, ...], Field(min_length=1), OneOrMany()]
_DRAWS = 200  # of phases, of which those with the least crest factor are taken
_POINTS, _FINE = 8, 64  # of a period of the highest frequency, where peaks are looked for: of draws, and of the best


@dataclass(frozen=True)
class Playing:
    """How long a signal is played, which unit its command has, and where files are."""

    unit: str
    time: float  # [s]
    folder: Path


class PlayedSignal(Described):
    """A signal of a command."""

    kind: Any  # its name in a file, a literal of each class
    slowest: ClassVar[str | None] = None  # the field with its lowest frequency, where its periods can be counted


class PlayedWave(PlayedSignal):
    """A signal of its own."""

    @abstractmethod
    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """The signal as a function of time, with one value of each field. Raises InputError."""

    def quantity(self, values: Mapping[str, Any], field: str, playing: Playing) -> float:
        """A field in the SI unit of the command. Raises InputError that names it."""
        try:
            return same_unit(values[field], playing.unit)
        except ValueError as error:
            raise InputError(str(error), field=field) from None


class PlayedStep(PlayedWave):
    """A constant."""

    kind: Literal["step"]
    height: _Several
    """The constant, which the ramps lead to and away from."""

    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """The height."""
        height = self.quantity(values, "height", playing)
        return lambda t: np.full(len(t), height)


class PlayedSine(PlayedWave):
    """A sine."""

    kind: Literal["sine"]
    slowest = "frequency"
    amplitude: _Several
    """Amplitude."""
    frequency: _Frequencies
    """Frequency."""
    offset: _Several = ("0",)
    """What it oscillates about."""
    phase: _Angles = (0.0,)
    """Its angle at the beginning."""

    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """offset + amplitude sin(2 pi frequency t + phase)."""
        size, mean = (self.quantity(values, name, playing) for name in ("amplitude", "offset"))
        rate, phase = 2 * np.pi * values["frequency"], values["phase"]
        return lambda t: mean + size * np.sin(rate * t + phase)


class PlayedChirp(PlayedWave):
    """A sine whose frequency grows, or falls, evenly on a logarithmic scale."""

    kind: Literal["chirp"]
    amplitude: _Several
    """Amplitude."""
    frequency: _Frequencies
    """First frequency."""
    to: _Frequencies
    """Last frequency."""
    offset: _Several = ("0",)
    """What it oscillates about."""

    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """Sine of the turns passed; before its beginning and after its end with its first and its last frequency."""
        size, mean = (self.quantity(values, name, playing) for name in ("amplitude", "offset"))
        ends = values["frequency"], values["to"], playing.time
        return lambda t: mean + size * np.sin(2 * np.pi * chirp_turns(t, *ends))


class PlayedMultisine(PlayedWave):
    """A sum of sines of one size, at a lowest frequency and its multiples, with random phases and a low crest factor.

    Of 200 draws of phases those with the least ratio of peak to rms are taken.
    """

    kind: Literal["multisine"]
    slowest = "frequency"
    amplitude: _Several
    """Largest value."""
    frequency: _Frequencies
    """Lowest frequency, and the distance of the others; its period is that of the signal."""
    to: _Frequencies
    """Highest frequency."""
    offset: _Several = ("0",)
    """What it oscillates about."""
    seed: Annotated[int, Field(ge=0, le=1_000_000)] = 1
    """Seed of the phases."""

    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """offset + a sum_k cos(2 pi k frequency t + phase_k), with a largest value of the amplitude."""
        size, mean = (self.quantity(values, name, playing) for name in ("amplitude", "offset"))
        base, count = values["frequency"], int(values["to"] / values["frequency"] + 1e-9)
        if not 1 <= count <= 10_000:
            raise InputError(f"{count} multiples of the lowest frequency; 1 to 10000 are possible.", field="to")
        numbers = np.arange(1, count + 1)
        phases = crest_phases(count, self.seed)
        largest = np.abs(_sum_of(numbers, phases, _FINE)).max()

        def wave(t: Time) -> Float[np.ndarray, "n"]:
            sines = np.zeros(len(t))
            for k, phase in zip(numbers, phases, strict=True):
                sines += np.cos(2 * np.pi * k * base * t + phase)
            return mean + size / largest * sines

        return wave


class PlayedFile(PlayedWave):
    """A column of a recording, linear between its samples."""

    kind: Literal["file"]
    file: Annotated[str, Field(min_length=1)]
    """The recording, relative to the plan."""
    column: str | None = None
    """The column, where several have the unit of the command."""
    factor: _Numbers = (1.0,)
    """What it is multiplied by."""

    def wave(self, values: Mapping[str, Any], playing: Playing) -> Wave:
        """The column; before its beginning and after its end it stays as it is there."""
        time, recorded = self.recorded(playing)
        return lambda t: values["factor"] * np.interp(t, time, recorded)

    def recorded(self, playing: Playing) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
        """Times from 0 on [s], and the values [SI]. Raises InputError."""
        dimension = dimension_of(playing.unit)
        assert DIMENSIONS[dimension].unit == playing.unit
        return recorded_reference(playing.folder / self.file, dimension, self.column)


class PlayedCopy(PlayedSignal):
    """The signal of another command, multiplied by a factor, such as -1 for muscles that work against each other."""

    kind: Literal["copy"]
    of: str
    """The other command."""
    factor: _Numbers = (1.0,)
    """What it is multiplied by."""
    phase: _Angles = (0.0,)
    """By how much it is ahead of the other one, which is a sine."""


@cache
def crest_phases(count: int, seed: int) -> Float[np.ndarray, "count"]:
    """Random phases [rad] of a sum of `count` sines, of those drawn the ones with the least crest factor."""
    numbers, draw = np.arange(1, count + 1), np.random.default_rng(seed)
    every = draw.uniform(0, 2 * np.pi, (_DRAWS, count))
    peaks = [np.abs(_sum_of(numbers, phases)).max() for phases in every]
    return every[int(np.argmin(peaks))]


def _sum_of(
    numbers: Float[np.ndarray, "count"], phases: Float[np.ndarray, "count"], fine: int = _POINTS
) -> Float[np.ndarray, "points"]:
    """Sum of sines over a period, at `fine` points or more in a period of the highest."""
    points = 2 ** int(np.ceil(np.log2(fine * (len(numbers) + 1))))
    spectrum = np.zeros(points // 2 + 1, complex)
    spectrum[numbers] = np.exp(1j * phases)
    return np.fft.irfft(spectrum, points) * points / 2

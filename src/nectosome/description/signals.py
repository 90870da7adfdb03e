"""Signals: what a joint, a tendon or a chamber is driven by over time, in the unit of what it drives.

References of controllers and plans of runs on a rig are signals too.
"""

import math
from typing import Annotated, Any, Generic, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from nectosome.description import fields
from nectosome.description.recorded_signals import SmoothRecordingSignal
from nectosome.description.signal_contract import Q, S, SignalDescription, SignalOf, T
from nectosome.io.schema.described import unfit, wrong


class ConstantSignal(SignalDescription, Generic[Q]):
    """The quantity `value` [SI], held."""

    kind: Literal["constant"]
    value: Q
    """The value, held."""
    signed = ("value",)

    def least(self) -> float:
        """Return the value."""
        return self.value


class RateSignal(SignalDescription, Generic[Q, S]):
    """The quantity `start + rate t` [SI; SI/s]."""

    kind: Literal["rate"]
    rate: S
    """Change per second."""
    start: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Value at time 0."""
    ramp: fields.Duration = 0.0
    """Time in which the rate grows to its full size."""
    signed = ("rate", "start")

    def least(self) -> float:
        """Return its start, or no bound where it falls."""
        return self.start if self.rate >= 0 else -math.inf

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        cls.cycle_angle = "start" if cls.dimension == "angle" else None


class OscillationSignal(SignalDescription, Generic[Q]):
    """What goes to and fro about a middle."""

    amplitude: Q
    """Largest distance from the middle."""
    frequency: fields.Frequency
    """Number of cycles per second."""
    phase: fields.Angle = 0.0
    """Angle by which the cycle is ahead at time 0; without it the middle is passed there, upward."""
    offset: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Middle of the motion."""
    ramp: fields.Duration = 0.0
    """Time in which the amplitude grows to its full size."""
    signed = ("amplitude", "offset")
    cycle_angle = "phase"


class SineSignal(OscillationSignal[Q], Generic[Q]):
    """The quantity `offset + amplitude sin(2 pi frequency t + phase)` [SI; Hz; rad]."""

    kind: Literal["sine"]


class TriangleSignal(OscillationSignal[Q], Generic[Q]):
    """Straight lines between `offset - amplitude` and `offset + amplitude`."""

    kind: Literal["triangle"]
    smooth = False


class StepSignal(SignalDescription, Generic[Q]):
    """The quantity `height` [SI] from a time on, and 0 before."""

    kind: Literal["step"]
    height: Q
    """Value after the step."""
    at: fields.Time | None = None
    """Time of the step; left out, the value is `height` all the time."""
    signed = ("height",)
    smooth = False
    once = "at", "a step comes once. Take a constant."

    def least(self) -> float:
        """Return the height, or 0 where that is less."""
        return min(self.height, 0.0)

    @property
    def moves(self) -> bool:
        """Whether there is a step."""
        return self.at is not None and bool(self.height)


class ChirpSignal(OscillationSignal[Q], Generic[Q]):
    """A sine whose frequency grows, or falls, evenly on a logarithmic scale, and stays as it is before and after."""

    kind: Literal["chirp"]
    frequency: fields.PositiveFrequency
    """First frequency, at time 0."""
    to: fields.PositiveFrequency
    """Last frequency."""
    time: fields.PositiveTime
    """Time in which it goes from the first to the last frequency."""
    once = "to", "a chirp does not repeat itself. Take a sine."


class MultisineSignal(OscillationSignal[Q], Generic[Q]):
    """A sum of sines of one size, at a lowest frequency and its multiples, with random phases and a low crest factor.

    Of 200 draws of phases those with the least ratio of peak to rms are taken.
    """

    kind: Literal["multisine"]
    frequency: fields.FixedFrequency
    """Lowest frequency, and the distance of the others; its period is that of the signal."""
    to: fields.FixedFrequency
    """Highest frequency."""
    phase: fields.Angle = 0.0
    """Angle of the lowest frequency by which all is ahead."""
    seed: Annotated[int, Field(ge=0, le=1_000_000)] = 1
    """Seed of the random phases."""

    @property
    def count(self) -> int:
        """Number of sines."""
        return int(self.to / self.frequency + 1e-9)

    @model_validator(mode="after")
    def _has_sines(self) -> Self:
        if not 1 <= self.count <= 10_000:
            raise wrong("to", f"{self.count} multiples of the lowest frequency; 1 to 10000 are possible.")
        return self


class VaryingSignal(SignalDescription, Generic[Q]):
    """One period of each of several sines after the other; before and after them the first and the last go on."""

    kind: Literal["varying"]
    amplitude: Annotated[tuple[Q, ...], Field(min_length=1)]
    """Amplitude of each sine."""
    frequency: Annotated[tuple[fields.PositiveFrequency, ...], Field(min_length=1)]
    """Frequency of each sine."""
    offset: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Middle of the motion."""
    signed = ("amplitude", "offset")
    smooth = False
    once = "frequency", "each of these sines comes once. Take one of them."

    def least(self) -> float:
        """Return the offset less the largest amplitude."""
        return self.offset - max(map(abs, self.amplitude))

    @property
    def length(self) -> float:
        """Time of all periods [s]."""
        return math.fsum(1 / frequency for frequency in self.frequency)

    @model_validator(mode="after")
    def _one_amplitude_each(self) -> Self:
        if len(self.amplitude) != len(self.frequency):
            why = f"{len(self.frequency)} frequencies for {len(self.amplitude)} amplitudes; as many are needed."
            raise wrong("frequency", why)
        return self


class SumSignal(SignalDescription, Generic[Q, T]):
    """The sum of several signals."""

    kind: Literal["sum"]
    terms: Annotated[tuple[T, ...], Field(min_length=1)]
    """The signals."""
    signed = ("terms",)

    def least(self) -> float:
        """Return the sum of the least values, which need not come at once."""
        return sum(term.least() for term in self.terms)

    @property
    def length(self) -> float | None:
        """Time of the longest term that has an end [s]."""
        return max((term.length for term in self.terms if term.length is not None), default=None)


class StrokeSignal(OscillationSignal[Q], Generic[Q]):
    """A stroke to and fro: half cosines between `offset - amplitude` and `offset + amplitude`."""

    kind: Literal["stroke"]
    forward_share: fields.Share = 0.5
    """Share of each period that goes to the forward stroke, towards larger values; with one half it is a sine."""


class CycleSignal(SignalDescription, Generic[Q]):
    """The quantity passes through values in each period, at least four, evenly spread, as a smooth curve."""

    kind: Literal["cycle"]
    values: Annotated[tuple[Q, ...], Field(min_length=4)]
    """Values evenly spread over a period, the first at time 0; between them is a periodic cubic spline."""
    frequency: fields.Frequency
    """Number of cycles per second."""
    phase: fields.Angle = 0.0
    """Angle by which the cycle is ahead at time 0."""
    ramp: fields.Duration = 0.0
    """Time in which the distance from the mean of the values grows to its full size."""
    signed = ("values",)
    cycle_angle = "phase"

    def least(self) -> float:
        """Return the smallest of the values."""
        return min(self.values)


def _somewhere(envelope: tuple[float, ...]) -> tuple[float, ...]:
    if not any(envelope):
        raise unfit("is 0 everywhere, so that nothing bends. Give at least one number above 0.")
    return envelope


Envelope = Annotated[tuple[fields.NonNegativeNumber, ...], Field(min_length=1), AfterValidator(_somewhere)]


class WaveSignal(OscillationSignal[Q], Generic[Q]):
    """The quantity `e(x) (offset + amplitude sin(2 pi (frequency t - x/wavelength) + phase))`, with the envelope e."""

    kind: Literal["wave"]
    wavelength: fields.Length | None = None
    """Length of a wave, which travels from the root to the tip. Without it all of the rod is in phase."""
    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the root to the tip, joined by straight lines, by which all is multiplied.
    """
    everywhere = False


class RaySignal(OscillationSignal[Q], Generic[Q]):
    """One of several in a row: the quantity `offset + e(x) amplitude sin(2 pi (frequency t - waves x) + phase)`."""

    kind: Literal["ray"]
    waves: fields.Number
    """Number of waves along the row; positive ones run from its first place to the last."""
    place: fields.Fraction
    """Its place x in the row: 0 of the first, 1 of the last."""
    envelope: Envelope = (1.0,)
    """Numbers e at places spread evenly along the row, joined by straight lines, by which the amplitude is multiplied.
    """

    def least(self) -> float:
        """Return the offset less the largest amplitude along the row."""
        return self.offset - max(self.envelope) * abs(self.amplitude)


class RecordedStrain(SmoothRecordingSignal[fields.Curvature]):
    """The curvature e(x) times the values that were recorded, as a smooth curve in time; e is the envelope.

    It stands still before the first and after the last sample.
    """

    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the root to the tip, joined by straight lines, by which all is multiplied.
    """


AngleSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Angle, motion=True)]
LengthSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Coordinate, motion=True)]
SpeedSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Speed)]
TorqueSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Torque)]
ForceSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Force)]
VoltageSignal = Annotated[SignalDescription, SignalOf(quantity=fields.Voltage)]
DutySignal = Annotated[SignalDescription, SignalOf(quantity=fields.Number)]
PressureSignal = Annotated[SignalDescription, SignalOf(quantity=fields.AnyPressure)]
MomentSignal = WaveSignal[fields.Torque]
StrainSignal = Annotated[WaveSignal[fields.Curvature] | RecordedStrain, Field(discriminator="kind")]

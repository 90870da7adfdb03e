"""Signals: what a joint, a tendon or a chamber is driven by over time, in the unit of what it drives."""

import json
from collections.abc import Mapping
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Generic, Literal, Self, TypeVar, get_args

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from nectosome.description.fields import (
    Angle,
    AngularSpeed,
    AnyPressure,
    Coordinate,
    Curvature,
    Duration,
    Force,
    Frequency,
    Length,
    NonNegativeNumber,
    Number,
    Share,
    Speed,
    Time,
    Torque,
    Voltage,
)
from nectosome.description.mirror import opposite
from nectosome.io.schema.described import Described, unfit, wrong
from nectosome.io.schema.quantity import Quantity, QuantitySource
from nectosome.units import DIMENSIONS, InputError, did_you_mean, expected, parse_quantity, shorten

_MOST_ROWS = 20_000

Q = TypeVar("Q", bound=float)
"""The quantity of a signal, such as `Angle`."""
S = TypeVar("S", bound=float)
"""Its rate, such as `AngularSpeed`."""


class SignalDescription(Described):
    """A function of time. `signed` are the fields that change their sign with it."""

    kind: Any  # its name in a file, a literal of each class
    dimension: ClassVar[str] = ""
    signed: ClassVar[tuple[str, ...]] = ()

    @classmethod
    def model_parametrized_name(cls, params: tuple[Any, ...]) -> str:
        """Return a name such as `SineAngle`, for `SineSignal[Angle]`."""
        return f"{cls.__name__.removesuffix('Signal')}{_quantity(params[0]).dimension.capitalize()}"

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        made: Mapping[str, Any] = cls.__pydantic_generic_metadata__
        if made["args"] and not made["parameters"]:
            cls.dimension = _quantity(made["args"][0]).dimension
            kind = DIMENSIONS[cls.dimension]
            about = (made["origin"].__doc__ or "").replace("SI", kind.unit)
            cls.__doc__ = about.replace("quantity", "displacement" if cls.dimension == "length" else kind.name)

    def opposite(self) -> Self:
        """Return the signal with the other sign."""
        return self.model_copy(update={name: opposite(getattr(self, name)) for name in self.signed})

    @property
    def moves(self) -> bool:
        """Whether its value goes to and fro, or is recorded and changes."""
        return bool(getattr(self, "amplitude", 0.0)) or len(set(getattr(self, "values", ()))) > 1


def _quantity(hint: Any) -> Quantity:
    return next(mark for mark in get_args(hint) if isinstance(mark, Quantity))


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
    ramp: Duration = 0.0
    """Time in which the rate grows to its full size."""
    signed = ("rate", "start")

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        super().__pydantic_init_subclass__(**kwargs)
        cls.cycle_angle = "start" if cls.dimension == "angle" else None


class SineSignal(SignalDescription, Generic[Q]):
    """The quantity `offset + amplitude sin(2 pi frequency t + phase)` [SI; Hz; rad]."""

    kind: Literal["sine"]
    amplitude: Q
    """Largest distance from the middle."""
    frequency: Frequency
    """Number of cycles per second."""
    phase: Angle = 0.0
    """Angle by which the cycle is ahead at time 0."""
    offset: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Middle of the motion."""
    ramp: Duration = 0.0
    """Time in which the amplitude grows to its full size."""
    signed = ("amplitude", "offset")
    cycle_angle = "phase"

    def least(self) -> float:
        """Return the offset less the amplitude."""
        return self.offset - abs(self.amplitude)


class StrokeSignal(SignalDescription, Generic[Q]):
    """A stroke to and fro: half cosines between `offset - amplitude` and `offset + amplitude`."""

    kind: Literal["stroke"]
    amplitude: Q
    """Largest distance from the middle."""
    frequency: Frequency
    """Number of cycles per second."""
    phase: Angle = 0.0
    """Angle by which the cycle is ahead: without it the middle of a forward stroke is at time 0."""
    offset: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Middle of the motion."""
    forward_share: Share = 0.5
    """Share of each period that goes to the forward stroke, towards larger values; with one half it is a sine."""
    ramp: Duration = 0.0
    """Time in which the amplitude grows to its full size."""
    signed = ("amplitude", "offset")
    cycle_angle = "phase"


class CycleSignal(SignalDescription, Generic[Q]):
    """The quantity passes through values in each period, at least four, evenly spread, as a smooth curve."""

    kind: Literal["cycle"]
    values: Annotated[tuple[Q, ...], Field(min_length=4)]
    """Values evenly spread over a period, the first at time 0; between them is a periodic cubic spline."""
    frequency: Frequency
    """Number of cycles per second."""
    phase: Angle = 0.0
    """Angle by which the cycle is ahead at time 0."""
    ramp: Duration = 0.0
    """Time in which the distance from the mean of the values grows to its full size."""
    signed = ("values",)
    cycle_angle = "phase"

    def least(self) -> float:
        """Return the smallest of the values."""
        return min(self.values)


def _increasing(times: tuple[float, ...]) -> tuple[float, ...]:
    for k, (before, after) in enumerate(pairwise(times), start=1):
        if not before < after:
            raise unfit(f"the times must increase: {after:g} s, number {k + 1}, comes after {before:g} s.")
    return times


Times = Annotated[tuple[Time, ...], Field(min_length=2), AfterValidator(_increasing)]
"""Times of samples [s], increasing."""


class RecordingSignal(SignalDescription, Generic[Q]):
    """The quantity that was recorded, at least two samples, joined by straight lines.

    Before the first and after the last of them the quantity stays as it is there.
    """

    kind: Literal["recording"]
    times: Times = ()
    """Times of the samples, increasing."""
    values: Annotated[tuple[Q, ...], Field(min_length=2)] = ()
    """Value at each time."""
    file: str | None = None
    """File of measurements that has the samples, relative to this one, instead of times and values. Time counts from
    its first row."""
    column: str | None = None
    """Column of that file."""
    sheet: str | None = None
    """Sheet that describes that file: its columns and units."""
    signed = ("values",)
    smooth: ClassVar[bool] = False

    @model_validator(mode="after")
    def _has_samples(self, info: ValidationInfo) -> Self:
        if self.file is not None:
            if self.times or self.values:
                raise wrong("times" if self.times else "values", "the file has the samples. Leave one of the two out.")
            if self.column is None:
                raise wrong("column", "is missing. Say which column of the file it is.")
            folder = info.context.folder if isinstance(info.context, QuantitySource) else QuantitySource().folder
            times, values = _read_samples(self.file, self.column, self.sheet, folder, self.dimension, self.smooth)
            read = {"times": times, "values": values, "file": None, "column": None, "sheet": None}
            for name, value in read.items():
                object.__setattr__(self, name, value)  # from here on it holds its samples, wherever the file is
        elif self.column is not None or self.sheet is not None:
            raise wrong("file", "is missing. Name the file that has the column.")
        for name in ("times", "values"):
            if not getattr(self, name):
                raise wrong(name, "is missing. Give times and values, or a file and a column.")
        if len(self.times) != len(self.values):
            why = f"there are {len(self.values)} values at {len(self.times)} times. Give one for each time."
            raise wrong("values", why)
        return self

    def least(self) -> float:
        """Return the smallest of the values."""
        return min(self.values)


def _read_samples(
    file: str, column: str, sheet: str | None, folder: Path, dimension: str, smooth: bool
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return times [s], from 0, and values [SI] of a column of a file in `folder`, or of a channel of its sheet.

    Raises the error of a field for a file that cannot be read, a column that is not there, another unit, a missing
    value, more than 20 000 rows and, for a `smooth` curve, a gap in time.
    """
    import numpy as np

    from nectosome.measure import read  # it takes a second, and few robots need it

    try:
        recording = read(folder / file, None if sheet is None else folder / sheet)
    except InputError as error:
        raise wrong("file" if sheet is None else "sheet", str(error)) from None
    if column not in recording.data_vars:
        known = [str(name) for name in recording.data_vars]
        raise wrong("column", f'{file} has no column "{shorten(column)}".{did_you_mean(column, known)}')
    if "time" not in recording.dims:
        raise wrong("file", f"{file} has no time. Say in a sheet which column it is, or its rate.")
    if recording.sizes["time"] > _MOST_ROWS:
        why = f"{file} has {recording.sizes['time']} rows, at most {_MOST_ROWS} can drive a robot."
        raise wrong("file", f"{why} Resample it with fewer, or cut a part out.")
    unit = str(recording[column].attrs.get("units", ""))
    if unit in ("", "1") and DIMENSIONS[dimension].unit:
        why = f"{file} gives it no unit. Write one into its heading, as in angle (deg), or into a sheet."
        raise wrong("column", why)
    if unit not in ("", "1"):
        try:
            parse_quantity(f"1 {unit}", dimension)  # SI already; rad may be left out, as in 1/m
        except ValueError:
            raise wrong("column", f"{file} has it in {unit}. {expected(dimension)}") from None
    values, time = recording[column].values.astype(float), recording["time"].values.astype(float)
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        found = json.loads(recording.attrs["provenance"])
        odd = [text for text in (*found["warnings"], *found["repairs"]) if text.startswith(f"{column}: ")]
        where = odd[0] if odd else f"{column}: {missing.size} values missing"
        why = f"{file}, {where}, at {time[missing[0]]:.9g} s. Fill them in, or leave these rows out."
        raise wrong("column", why)
    gaps = json.loads(recording.attrs["gaps"]) if smooth else []
    if gaps:
        since, until, row = gaps[0]
        why = f"{file}, row {row}: nothing was recorded between {since:.9g} s and {until:.9g} s."
        raise wrong("file", f"{why} Cut out a part without a gap.")
    return tuple((time - time[0]).tolist()), tuple(values.tolist())


class SmoothRecordingSignal(RecordingSignal[Q], Generic[Q]):
    """The quantity that was recorded, at least four samples, as a smooth curve through them.

    The curve is a cubic spline whose third derivative is continuous at the second and the last but one sample
    (not-a-knot). The first time is at most 0 s. Before the first and after the last sample the quantity stands still at
    that sample: let a recording end at rest if the motion goes on after it.
    """

    smooth = True

    @model_validator(mode="after")
    def _is_a_motion(self) -> Self:
        if len(self.times) < 4:
            raise wrong("values", f"a smooth curve needs at least 4 samples, {len(self.times)} given.")
        if self.times[0] > 0:
            why = f"nothing is known of the motion before {self.times[0]:g} s. Let the first time be at most 0 s."
            raise wrong("times.0", why)
        return self


def _somewhere(envelope: tuple[float, ...]) -> tuple[float, ...]:
    if not any(envelope):
        raise unfit("is 0 everywhere, so that nothing bends. Give at least one number above 0.")
    return envelope


Envelope = Annotated[tuple[NonNegativeNumber, ...], Field(min_length=1), AfterValidator(_somewhere)]


class WaveSignal(SignalDescription, Generic[Q]):
    """The quantity `e(x) (offset + amplitude sin(2 pi (frequency t - x/wavelength) + phase))`, with the envelope e."""

    kind: Literal["wave"]
    frequency: Frequency
    """Number of cycles per second."""
    wavelength: Length | None = None
    """Length of a wave, which travels from the root to the tip. Without it all of the rod is in phase."""
    phase: Angle = 0.0
    """Angle by which the cycle is ahead at time 0."""
    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the root to the tip, joined by straight lines, by which all is multiplied.
    """
    ramp: Duration = 0.0
    """Time in which the amplitude grows to its full size."""
    amplitude: Q
    """Largest distance from the middle."""
    offset: Q = 0.0  # pyright: ignore[reportAssignmentType]
    """Middle of the motion."""
    signed = ("amplitude", "offset")
    cycle_angle = "phase"


class RecordedStrain(SmoothRecordingSignal[Curvature]):
    """The curvature e(x) times the values that were recorded, as a smooth curve in time; e is the envelope.

    It stands still before the first and after the last sample.
    """

    envelope: Envelope = (1.0,)
    """Numbers at places spread evenly from the root to the tip, joined by straight lines, by which all is multiplied.
    """


AngleSignal = Annotated[
    ConstantSignal[Angle]
    | RateSignal[Angle, AngularSpeed]
    | SineSignal[Angle]
    | StrokeSignal[Angle]
    | SmoothRecordingSignal[Angle],
    Field(discriminator="kind"),
]
LengthSignal = Annotated[
    ConstantSignal[Coordinate]
    | RateSignal[Coordinate, Speed]
    | SineSignal[Coordinate]
    | SmoothRecordingSignal[Coordinate],
    Field(discriminator="kind"),
]
TorqueSignal = Annotated[
    ConstantSignal[Torque] | SineSignal[Torque] | CycleSignal[Torque] | RecordingSignal[Torque],
    Field(discriminator="kind"),
]
ForceSignal = Annotated[
    ConstantSignal[Force] | SineSignal[Force] | CycleSignal[Force] | RecordingSignal[Force],
    Field(discriminator="kind"),
]
VoltageSignal = Annotated[
    ConstantSignal[Voltage] | SineSignal[Voltage] | CycleSignal[Voltage] | RecordingSignal[Voltage],
    Field(discriminator="kind"),
]
DutySignal = Annotated[
    ConstantSignal[Number] | SineSignal[Number] | CycleSignal[Number] | RecordingSignal[Number],
    Field(discriminator="kind"),
]
PressureSignal = Annotated[
    ConstantSignal[AnyPressure] | SineSignal[AnyPressure] | CycleSignal[AnyPressure] | RecordingSignal[AnyPressure],
    Field(discriminator="kind"),
]
MomentSignal = WaveSignal[Torque]
StrainSignal = Annotated[WaveSignal[Curvature] | RecordedStrain, Field(discriminator="kind")]

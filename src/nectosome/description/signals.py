"""Prescribed signals: what a joint is made to do over time, in the unit of what it drives."""

from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import AfterValidator, Field, model_validator

from nectosome.description.base import Described, unfit, wrong
from nectosome.description.fields import (
    Angle,
    AngularSpeed,
    AnyPressure,
    Coordinate,
    Duration,
    Force,
    Frequency,
    Share,
    Speed,
    Time,
    Torque,
)


def _increasing(times: tuple[float, ...]) -> tuple[float, ...]:
    for k, (before, after) in enumerate(pairwise(times), start=1):
        if not before < after:
            raise unfit(f"the times must increase: {after:g} s, number {k + 1}, comes after {before:g} s.")
    return times


Times = Annotated[tuple[Time, ...], Field(min_length=2), AfterValidator(_increasing)]
"""Times of samples [s], increasing."""


class ConstantAngle(Described):
    """The angle `value` [rad], held."""

    kind: Literal["constant"]
    value: Angle


class RateAngle(Described):
    """The angle `start + rate t` [rad; rad/s]."""

    kind: Literal["rate"]
    rate: AngularSpeed
    start: Angle = 0.0


class SineAngle(Described):
    """The angle `offset + amplitude sin(2 pi frequency t + phase)` [rad; Hz]."""

    kind: Literal["sine"]
    amplitude: Angle
    frequency: Frequency
    phase: Angle = 0.0
    offset: Angle = 0.0


class StrokeAngle(Described):
    """A stroke to and fro [rad; Hz; s]: half cosines between `offset - amplitude` and `offset + amplitude`.

    `forward_share` of each period goes to the forward stroke, towards larger angles; with one half it is a sine. The
    middle of a forward stroke is at time 0, earlier by `phase` [rad]. The amplitude grows to its full size in `ramp`.
    """

    kind: Literal["stroke"]
    amplitude: Angle
    frequency: Frequency
    phase: Angle = 0.0
    offset: Angle = 0.0
    forward_share: Share = 0.5
    ramp: Duration = 0.0


class ConstantLength(Described):
    """The displacement `value` [m], held."""

    kind: Literal["constant"]
    value: Coordinate


class RateLength(Described):
    """The displacement `start + rate t` [m; m/s]."""

    kind: Literal["rate"]
    rate: Speed
    start: Coordinate = 0.0


class SineLength(Described):
    """The displacement `offset + amplitude sin(2 pi frequency t + phase)` [m; Hz; rad]."""

    kind: Literal["sine"]
    amplitude: Coordinate
    frequency: Frequency
    phase: Angle = 0.0
    offset: Coordinate = 0.0


class ConstantTorque(Described):
    """The torque `value` [N m], held."""

    kind: Literal["constant"]
    value: Torque


class SineTorque(Described):
    """The torque `offset + amplitude sin(2 pi frequency t + phase)` [N m; Hz; rad]."""

    kind: Literal["sine"]
    amplitude: Torque
    frequency: Frequency
    phase: Angle = 0.0
    offset: Torque = 0.0


class CycleTorque(Described):
    """The torque that goes through `values` [N m] in each period, evenly spread, as a smooth curve [Hz; rad]."""

    kind: Literal["cycle"]
    values: Annotated[tuple[Torque, ...], Field(min_length=4)]
    frequency: Frequency
    phase: Angle = 0.0


class RecordedTorque(Described):
    """The torque that was recorded: `values` [N m] at `times` [s], at least two, joined by straight lines.

    The times increase; before the first and after the last of them the torque stays as it is there.
    """

    kind: Literal["recording"]
    times: Times
    values: Annotated[tuple[Torque, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _one_value_a_time(self) -> Self:
        _check_samples(self.times, self.values)
        return self


class ConstantForce(Described):
    """The force `value` [N], held."""

    kind: Literal["constant"]
    value: Force


class SineForce(Described):
    """The force `offset + amplitude sin(2 pi frequency t + phase)` [N; Hz; rad]."""

    kind: Literal["sine"]
    amplitude: Force
    frequency: Frequency
    phase: Angle = 0.0
    offset: Force = 0.0


class CycleForce(Described):
    """The force that goes through `values` [N] in each period, evenly spread, as a smooth curve [Hz; rad].

    The first of them, at least four, is at time 0, earlier by `phase`; between them is a periodic cubic spline.
    """

    kind: Literal["cycle"]
    values: Annotated[tuple[Force, ...], Field(min_length=4)]
    frequency: Frequency
    phase: Angle = 0.0


class RecordedForce(Described):
    """The force that was recorded: `values` [N] at `times` [s], at least two, joined by straight lines.

    The times increase; before the first and after the last of them the force stays as it is there.
    """

    kind: Literal["recording"]
    times: Times
    values: Annotated[tuple[Force, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _one_value_a_time(self) -> Self:
        _check_samples(self.times, self.values)
        return self


class ConstantPressure(Described):
    """The pressure `value` [Pa], held."""

    kind: Literal["constant"]
    value: AnyPressure


class SinePressure(Described):
    """The pressure `offset + amplitude sin(2 pi frequency t + phase)` [Pa; Hz; rad]."""

    kind: Literal["sine"]
    amplitude: AnyPressure
    frequency: Frequency
    phase: Angle = 0.0
    offset: AnyPressure = 0.0


class CyclePressure(Described):
    """The pressure that goes through `values` [Pa] in each period, evenly spread, as a smooth curve [Hz; rad].

    The first of them, at least four, is at time 0, earlier by `phase`; between them is a periodic cubic spline.
    """

    kind: Literal["cycle"]
    values: Annotated[tuple[AnyPressure, ...], Field(min_length=4)]
    frequency: Frequency
    phase: Angle = 0.0


class RecordedPressure(Described):
    """The pressure that was recorded: `values` [Pa] at `times` [s], at least two, joined by straight lines.

    The times increase; before the first and after the last of them the pressure stays as it is there.
    """

    kind: Literal["recording"]
    times: Times
    values: Annotated[tuple[AnyPressure, ...], Field(min_length=2)]

    @model_validator(mode="after")
    def _one_value_a_time(self) -> Self:
        _check_samples(self.times, self.values)
        return self


def _check_samples(times: tuple[float, ...], values: tuple[float, ...]) -> None:
    if len(times) != len(values):
        raise wrong("values", f"there are {len(values)} values at {len(times)} times. Give one for each time.")


AngleSignal = Annotated[ConstantAngle | RateAngle | SineAngle | StrokeAngle, Field(discriminator="kind")]
LengthSignal = Annotated[ConstantLength | RateLength | SineLength, Field(discriminator="kind")]
TorqueSignal = Annotated[ConstantTorque | SineTorque | CycleTorque | RecordedTorque, Field(discriminator="kind")]
ForceSignal = Annotated[ConstantForce | SineForce | CycleForce | RecordedForce, Field(discriminator="kind")]
PressureSignal = Annotated[
    ConstantPressure | SinePressure | CyclePressure | RecordedPressure, Field(discriminator="kind")
]

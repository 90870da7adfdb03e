"""Rig files: the device, its connections, and the limits of its commands and measurements."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeVar

import numpy as np
from pydantic import Field, create_model

from nectosome.controllers.commands import unit_text
from nectosome.description.fields import Angle, AngularSpeed, AnyPressure, Coordinate, PositiveNumber
from nectosome.io.schema.described import Described
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.validate import line_of, validate_as
from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.units import InputError, did_you_mean, shorten, unit_to_si

from .bench import actuator_loop
from .dynamixel import Dynamixel, Servo
from .guards import Limits
from .ni import Laser, NationalInstruments, Valve, Watchdog, Wiring
from .rig import Rig, RigError
from .serial_motor import MotorLink, SerialMotor
from .simulated_rig import SimulatedRig

if TYPE_CHECKING:
    from nectosome.identification.hysteresis.fit import Identified

_Created = TypeVar("_Created")
_Voltage = Annotated[float, Quantity("voltage")]
_PressureRate = Annotated[float, Quantity("pressure_rate")]
_AngularAcceleration = Annotated[float, Quantity("angular_acceleration")]
_PressurePerVolt = Annotated[float, Quantity("pressure_per_volt")]
_LengthPerVolt = Annotated[float, Quantity("length_per_volt")]
_Time = Annotated[float, Quantity("time", minimum=0, exclusive=True)]
_Count = Annotated[int, Field(ge=1, le=1_000_000)]
_Word = Annotated[str, Field(min_length=1)]
_Baud = Annotated[int, Field(ge=300, le=10_000_000)]


@dataclass(frozen=True)
class RigFile:
    """A rig as its file describes it."""

    rig: Rig
    limits: Limits
    dt: float  # between samples [s]
    command_unit: tuple[str, float]  # in which the limits of commands are written, and its size in SI
    model: "Identified | None" = None  # of a simulated rig


def load_rig(path: str | Path) -> RigFile:
    """Read a rig file; no device is opened. Raises InputError that names file, line and field."""
    data, lines = read_yaml(read_text(path), str(path))
    kinds: dict[str, Any] = {
        "ni": (_NI, _ni),
        "dynamixel": (_DYNAMIXEL, _dynamixel),
        "serial": (_SERIAL, _serial),
        "simulated": (_SIMULATED, None),
    }
    kind = str(data.get("kind") or "") if isinstance(data, dict) else ""
    if isinstance(data, dict) and kind not in kinds:
        message = f'there is no rig "{shorten(kind)}".' if kind else "is missing."
        message += did_you_mean(kind, kinds) or f" Write one of {', '.join(kinds)}."
        raise InputError(message, file=str(path), line=lines.get(("kind",)), field="kind")
    schema, make = kinds.get(kind, kinds["ni"])
    least = f"A rig file has at least a kind ({', '.join(kinds)}), dt and limits."
    given: Any = validate_as(schema, data, least, file=str(path), lines=lines)
    file = _File(str(path), lines)
    limits = file.create(Limits, given.limits, "limits")
    texts = [unit_text(str(data["limits"][name])) for name in ("high", "low")]
    if kind == "simulated":
        model = _model(file, given)
        loop, pace = actuator_loop(model, limits, given.dt, given.noise), "real" if given.real_time else "virtual"
        rig: Rig = SimulatedRig(loop.plant, loop.sensor, dt=given.dt / loop.substeps, pace=pace)
    else:
        model, rig = None, make(file, given, limits)
    unit = next(filter(None, texts), rig.command_unit)
    return RigFile(rig, limits, given.dt, (unit, unit_to_si(unit)[0]), model)


class _File:
    """A file, for its errors."""

    def __init__(self, source: str, lines: dict[Key, int]):
        self._source, self._lines = source, lines
        self.folder = Path(source).parent

    def wrong(self, message: str, *at: str | int) -> InputError:
        """The error of a field."""
        field = ".".join(map(str, at))
        return InputError(message, file=self._source, line=line_of(at, self._lines), field=field or None)

    def create(self, kind: Callable[..., _Created], group: Any, *at: str | int) -> _Created:
        """A dataclass from the fields of a group."""
        try:
            return kind(**{name: getattr(group, name) for name in inspect.signature(kind).parameters})
        except InputError as error:
            raise self.wrong(error.message, *at, *([error.field] if error.field else [])) from None

    def check_ends(self, limits: Limits, check: Callable[[float], object]) -> None:
        """Check that the device takes commands at both ends of their range."""
        for name in ("low", "high"):
            try:
                check(getattr(limits, name))
            except RigError as error:
                raise self.wrong(str(error), "limits", name) from None

    def outlasts(self, watchdog: float, dt: float, *at: str) -> None:
        """Check that a watchdog waits longer than the time between samples."""
        if watchdog <= dt:
            message = f"{watchdog:g} s, and dt is {dt:g} s: it would act between two samples. Take several times dt."
            raise self.wrong(message, *at)


def _ni(file: _File, given: Any, limits: Limits) -> Rig:
    valves = tuple(file.create(Valve, valve, "valves", k) for k, valve in enumerate(given.valves))
    watchdog = given.watchdog and file.create(Watchdog, given.watchdog, "watchdog")
    if watchdog:
        file.outlasts(watchdog.timeout, given.dt, "watchdog", "timeout")
    for valve in valves:
        file.check_ends(limits, valve.volts)
    return NationalInstruments(Wiring(valves, file.create(Laser, given.laser, "laser"), watchdog))


def _dynamixel(file: _File, given: Any, limits: Limits) -> Rig:
    rig = Dynamixel(file.create(Servo, given))
    file.outlasts(given.watchdog, given.dt, "watchdog")
    file.check_ends(limits, rig.step)
    return rig


def _serial(file: _File, given: Any, limits: Limits) -> Rig:
    file.outlasts(given.watchdog, given.dt, "watchdog")
    return SerialMotor(file.create(MotorLink, given))


@dataclass(frozen=True)
class Simulation:
    """A simulated actuator: a saved model, whose path is relative to the rig file, or the numbers of a linear one."""

    model: str | None = None
    gain: float | None = None  # [m/Pa]
    frequency: float | None = None  # natural frequency of the linear model [rad/s]
    damping: float = 1.0  # its damping ratio
    noise: float | None = None  # standard deviation of the sensor; that of the model unless given [m]
    real_time: bool = False


def _model(file: _File, given: Any) -> "Identified":
    """The model of a simulated rig: saved, or linear, without hysteresis."""
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.identification.hysteresis.fit import Identified
    from nectosome.io import load_dataset

    linear = {name: getattr(given, name) for name in ("gain", "frequency")}
    if given.model is None:
        for name, value in linear.items():
            if value is None:
                raise file.wrong("is missing: give model, or gain and frequency.", name)
        theta = {"frequency": given.frequency, "damping": given.damping}
        slopes, thresholds = np.full(2, given.gain), np.array([given.limits.high - given.limits.low])
        return Identified(theta, {}, thresholds, slopes, 0.0, 2, ())
    for name, value in linear.items():
        if value is not None:
            raise file.wrong("belongs to a linear model: leave it or model out.", name)
    try:
        return saved_model(load_dataset(file.folder / given.model))
    except InputError as error:
        raise file.wrong(str(error), "model") from None


def _group(kind: type, /, **units: Any) -> Any:
    """Schema of a group of fields for a dataclass, with the same defaults; `units` has the types of its numbers."""
    known: dict[str, Any] = {
        field.name: (units.pop(field.name, field.type), ... if field.default is MISSING else field.default)
        for field in fields(kind)
    }
    return create_model(kind.__name__, __base__=Described, **known, **units)


def _rig(settings: type, command: Any, rate: Any, measured: Any, **units: Any) -> Any:
    """Schema of the file of a rig, whose settings are a dataclass; types of command, its rate, and measurement."""
    limits = _group(
        Limits, low=command, high=command, slew=rate, least=measured, most=measured, error=measured,
        error_time=_Time, saturated_time=_Time, frozen_time=_Time, frozen_share=PositiveNumber,
        overrun=PositiveNumber, overruns_in_row=_Count, overruns_share=PositiveNumber,
    )  # fmt: skip
    return _group(settings, kind=(str, ...), about=(str, ""), dt=(_Time, ...), limits=(limits, ...), **units)


_LASER = _group(Laser, channel=_Word, zero=_Voltage, slope=_LengthPerVolt, low=_Voltage, high=_Voltage)
_VALVE = _group(Valve, channel=_Word, zero=_Voltage, slope=_PressurePerVolt, low=_Voltage, high=_Voltage)
_WATCHDOG = _group(Watchdog, device=_Word, timeout=_Time)
_VALVES = Annotated[tuple[_VALVE, ...], Field(min_length=1)]
_NI = _rig(Wiring, AnyPressure, _PressureRate, Coordinate, valves=_VALVES, laser=_LASER, watchdog=_WATCHDOG | None)
_DYNAMIXEL = _rig(
    Servo, Angle, AngularSpeed, Angle,
    port=_Word, number=Annotated[int, Field(ge=0, le=252)], baud=_Baud, speed=AngularSpeed, watchdog=_Time,
)  # fmt: skip
_SERIAL = _rig(
    MotorLink, AngularSpeed, _AngularAcceleration, AngularSpeed,
    port=_Word, baud=_Baud, timeout=_Time, start=_Time, watchdog=_Time,
)  # fmt: skip
_NOISE = Annotated[float, Quantity("length", minimum=0)]
_GAIN = Annotated[float, Quantity("length_per_pressure", minimum=0, exclusive=True)]
_FREQUENCY = Annotated[float, Quantity("angular_speed", minimum=0, exclusive=True)]
_SIMULATED = _rig(
    Simulation, AnyPressure, _PressureRate, Coordinate,
    model=_Word | None, gain=_GAIN | None, frequency=_FREQUENCY | None, damping=PositiveNumber, noise=_NOISE | None,
)  # fmt: skip

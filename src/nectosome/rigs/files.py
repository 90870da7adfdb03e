"""Rig files: the device, its connections, and the limits of its commands and measurements."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar

import numpy as np
from pydantic import Field, create_model

from nectosome.controllers.commands import unit_text
from nectosome.description.fields import Angle, AngularSpeed, AnyPressure, Coordinate, PositiveNumber, PositiveTime
from nectosome.io.schema.described import Described
from nectosome.io.schema.kinds import check_kind
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
    kind = str(data.get("kind") or "") if isinstance(data, dict) else ""
    if isinstance(data, dict) and kind not in RIG_MODELS:
        check_kind(data, "rig", str(path))
        message = f'there is no rig "{shorten(kind)}".' if kind else "is missing."
        message += did_you_mean(kind, RIG_MODELS) or f" Write one of {', '.join(RIG_MODELS)}."
        raise InputError(message, file=str(path), line=lines.get(("kind",)), field="kind")
    given: Any = validate_as(RIG_MODELS.get(kind, _NI), data, "rig", file=str(path), lines=lines)
    file = _File(str(path), lines)
    limits = file.create(Limits, given.limits, "limits")
    texts = [unit_text(str(data["limits"][name])) for name in ("high", "low")]
    if kind == "simulated":
        model = _model(file, given)
        loop, pace = actuator_loop(model, limits, given.dt, given.noise), "real" if given.real_time else "virtual"
        rig: Rig = SimulatedRig(loop.plant, loop.sensor, dt=given.dt / loop.substeps, pace=pace)
    else:
        makers = {"ni": _ni, "dynamixel": _dynamixel, "serial": _serial}
        model, rig = None, makers[kind](file, given, limits)
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
    """A simulated actuator: a saved model, or the numbers of a linear one."""

    model: str | None = None
    """A model saved by `nectosome identify hysteresis --save`, relative to this file, instead of gain and frequency."""
    gain: float | None = None  # [m/Pa]
    """Displacement per pressure of a linear model."""
    frequency: float | None = None  # [rad/s]
    """Natural frequency of a linear model."""
    damping: float = 1.0
    """Damping ratio of a linear model."""
    noise: float | None = None  # [m]
    """Standard deviation of the sensor; that of the model where it is left out."""
    real_time: bool = False
    """Whether a run takes as long as on a real rig."""


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
        return saved_model(load_dataset(file.folder / given.model), given.model)
    except InputError as error:
        raise file.wrong(str(error), "model") from None


class RigDescription(Described):
    """The file of a rig: its device, its connections, and the limits of its commands and measurements."""

    kind: Any  # its name in a file, a literal of each class
    about: str = ""
    """What the rig is, in sentences."""
    dt: PositiveTime
    """Time between samples."""
    limits: Any
    """Limits of commands and measurements. All of them are always checked."""


def _group(settings: type, base: type[Described] = Described, name: str = "", /, **types: Any) -> Any:
    """Model of a group of fields for a dataclass, with the same defaults; `types` has those of its fields."""
    known: dict[str, Any] = {
        field.name: (types.pop(field.name, field.type), ... if field.default is MISSING else field.default)
        for field in fields(settings)
    }
    model = create_model(name or settings.__name__, __base__=base, __doc__=settings.__doc__, **known, **types)
    model.described_in = settings
    return model


def _rig(kind: str, settings: type, command: Any, rate: Any, measured: Any, **types: Any) -> Any:
    """Model of the file of a rig, whose settings are a dataclass; types of command, its rate, and measurement."""
    limits = _group(
        Limits, Described, f"{settings.__name__}Limits",
        low=command, high=command, slew=rate, least=measured, most=measured, error=measured,
        error_time=PositiveTime, saturated_time=PositiveTime, frozen_time=PositiveTime, frozen_share=PositiveNumber,
        overrun=PositiveNumber, overruns_in_row=_Count, overruns_share=PositiveNumber,
    )  # fmt: skip
    return _group(settings, RigDescription, kind=(Literal[kind], ...), limits=(limits, ...), **types)


_LASER = _group(Laser, channel=_Word, zero=_Voltage, slope=_LengthPerVolt, low=_Voltage, high=_Voltage)
_VALVE = _group(Valve, channel=_Word, zero=_Voltage, slope=_PressurePerVolt, low=_Voltage, high=_Voltage)
_WATCHDOG = _group(Watchdog, device=_Word, timeout=PositiveTime)
_VALVES = Annotated[tuple[_VALVE, ...], Field(min_length=1)]
_NI = _rig(
    "ni", Wiring, AnyPressure, _PressureRate, Coordinate,
    valves=_VALVES, laser=_LASER, watchdog=_WATCHDOG | None,
)  # fmt: skip
_DYNAMIXEL = _rig(
    "dynamixel", Servo, Angle, AngularSpeed, Angle,
    port=_Word, number=Annotated[int, Field(ge=0, le=252)], baud=_Baud, speed=AngularSpeed, watchdog=PositiveTime,
)  # fmt: skip
_SERIAL = _rig(
    "serial", MotorLink, AngularSpeed, _AngularAcceleration, AngularSpeed,
    port=_Word, baud=_Baud, timeout=PositiveTime, start=PositiveTime, watchdog=PositiveTime,
)  # fmt: skip
_NOISE = Annotated[float, Quantity("length", minimum=0)]
_GAIN = Annotated[float, Quantity("length_per_pressure", minimum=0, exclusive=True)]
_FREQUENCY = Annotated[float, Quantity("angular_speed", minimum=0, exclusive=True)]
_SIMULATED = _rig(
    "simulated", Simulation, AnyPressure, _PressureRate, Coordinate,
    model=_Word | None, gain=_GAIN | None, frequency=_FREQUENCY | None, damping=PositiveNumber, noise=_NOISE | None,
)  # fmt: skip

RIG_MODELS = {"ni": _NI, "dynamixel": _DYNAMIXEL, "serial": _SERIAL, "simulated": _SIMULATED}

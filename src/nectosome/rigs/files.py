"""Rig files: which device there is, where it is connected, and the limits of what it may be asked for."""

import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field, create_model

from nectosome.description import Quantity
from nectosome.description.base import Described
from nectosome.description.validate import line_of, validate_as
from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.units import InputError, did_you_mean, shorten

from .dynamixel import Dynamixel, Servo
from .limits import Limits
from .ni import Laser, NationalInstruments, Valve, Watchdog, Wiring
from .rig import Rig, RigError
from .serial_motor import MotorLink, SerialMotor

_Made = TypeVar("_Made")
_Pressure = Annotated[float, Quantity("pressure")]
_Length = Annotated[float, Quantity("length")]
_Angle = Annotated[float, Quantity("angle")]
_AngularSpeed = Annotated[float, Quantity("angular_speed")]
_Voltage = Annotated[float, Quantity("voltage")]
_PressureRate = Annotated[float, Quantity("pressure_rate")]
_AngularAcceleration = Annotated[float, Quantity("angular_acceleration")]
_PressurePerVolt = Annotated[float, Quantity("pressure_per_volt")]
_LengthPerVolt = Annotated[float, Quantity("length_per_volt")]
_Time = Annotated[float, Quantity("time", minimum=0, exclusive=True)]
_Share = Annotated[float, Quantity("number", minimum=0, exclusive=True)]
_Count = Annotated[int, Field(ge=1, le=1_000_000)]
_Word = Annotated[str, Field(min_length=1)]
_Baud = Annotated[int, Field(ge=300, le=10_000_000)]


@dataclass(frozen=True)
class RigFile:
    """What a file says of a rig; `dt` [s] is the time between samples."""

    rig: Rig
    limits: Limits
    dt: float


def load_rig(path: str | Path) -> RigFile:
    """Read a rig file; nothing is opened yet. Raises InputError that names file, line and field.

    Simulated rigs have no file: they need a model.
    """
    data, lines = read_yaml(read_text(path), str(path))
    kinds = {"ni": (_NI, _ni), "dynamixel": (_DYNAMIXEL, _dynamixel), "serial": (_SERIAL, _serial)}
    kind = str(data.get("kind") or "") if isinstance(data, dict) else ""
    if isinstance(data, dict) and kind not in kinds:
        told = f'there is no rig "{shorten(kind)}".' if kind else "is missing."
        told += did_you_mean(kind, kinds) or f" Write one of {', '.join(kinds)}."
        raise InputError(told, file=str(path), line=lines.get(("kind",)), field="kind")
    model, made = kinds.get(kind, kinds["ni"])
    least = f"A rig file has at least a kind ({', '.join(kinds)}), dt and limits."
    said: Any = validate_as(model, data, least, file=str(path), lines=lines)
    file = _File(str(path), lines)
    limits = file.made(Limits, said.limits, "limits")
    return RigFile(made(file, said, limits), limits, said.dt)


class _File:
    """Where mistakes of a file are."""

    def __init__(self, source: str, lines: dict[Key, int]):
        self._source, self._lines = source, lines

    def wrong(self, message: str, *at: str | int) -> InputError:
        """The error of a field."""
        field = ".".join(map(str, at))
        return InputError(message, file=self._source, line=line_of(at, self._lines), field=field or None)

    def made(self, kind: Callable[..., _Made], group: Any, *at: str | int) -> _Made:
        """What the fields of a group are made into."""
        try:
            return kind(**{name: getattr(group, name) for name in inspect.signature(kind).parameters})
        except InputError as error:
            raise self.wrong(error.message, *at, *([error.field] if error.field else [])) from None

    def look(self, limits: Limits, check: Callable[[float], object]) -> None:
        """Whether the device can take commands at the ends of their range."""
        for name in ("low", "high"):
            try:
                check(getattr(limits, name))
            except RigError as error:
                raise self.wrong(str(error), "limits", name) from None

    def outlasts(self, watchdog: float, dt: float, *at: str) -> None:
        """Whether a watchdog waits longer than from one sample to the next."""
        if watchdog <= dt:
            told = f"{watchdog:g} s, and dt is {dt:g} s: it would act between two samples. Take several times dt."
            raise self.wrong(told, *at)


def _ni(file: _File, said: Any, limits: Limits) -> Rig:
    valves = tuple(file.made(Valve, valve, "valves", k) for k, valve in enumerate(said.valves))
    watchdog = said.watchdog and file.made(Watchdog, said.watchdog, "watchdog")
    if watchdog:
        file.outlasts(watchdog.timeout, said.dt, "watchdog", "timeout")
    for valve in valves:
        file.look(limits, valve.volts)
    return NationalInstruments(Wiring(valves, file.made(Laser, said.laser, "laser"), watchdog))


def _dynamixel(file: _File, said: Any, limits: Limits) -> Rig:
    rig = Dynamixel(file.made(Servo, said))
    file.outlasts(said.watchdog, said.dt, "watchdog")
    file.look(limits, rig.step)
    return rig


def _serial(file: _File, said: Any, limits: Limits) -> Rig:
    file.outlasts(said.watchdog, said.dt, "watchdog")
    return SerialMotor(file.made(MotorLink, said))


def _group(made: type, /, **units: Any) -> Any:
    """What a file says to make a dataclass, with the same defaults; `units` says what its numbers are."""
    known: dict[str, Any] = {
        field.name: (units.pop(field.name, field.type), ... if field.default is MISSING else field.default)
        for field in fields(made)
    }
    return create_model(made.__name__, __base__=Described, **known, **units)


def _rig(made: type, command: Any, rate: Any, measured: Any, **units: Any) -> Any:
    """A file of a rig, whose settings are a dataclass; commands, their rate and measurements have units."""
    limits = _group(
        Limits, low=command, high=command, slew=rate, least=measured, most=measured, error=measured,
        error_time=_Time, saturated_time=_Time, frozen_time=_Time, frozen_share=_Share,
        overrun=_Share, overruns_in_row=_Count, overruns_share=_Share,
    )  # fmt: skip
    return _group(made, kind=(str, ...), about=(str, ""), dt=(_Time, ...), limits=(limits, ...), **units)


_LASER = _group(Laser, channel=_Word, zero=_Voltage, slope=_LengthPerVolt, low=_Voltage, high=_Voltage)
_VALVE = _group(Valve, channel=_Word, zero=_Voltage, slope=_PressurePerVolt, low=_Voltage, high=_Voltage)
_WATCHDOG = _group(Watchdog, device=_Word, timeout=_Time)
_VALVES = Annotated[tuple[_VALVE, ...], Field(min_length=1)]
_NI = _rig(Wiring, _Pressure, _PressureRate, _Length, valves=_VALVES, laser=_LASER, watchdog=_WATCHDOG | None)
_DYNAMIXEL = _rig(
    Servo, _Angle, _AngularSpeed, _Angle,
    port=_Word, number=Annotated[int, Field(ge=0, le=252)], baud=_Baud, speed=_AngularSpeed, watchdog=_Time,
)  # fmt: skip
_SERIAL = _rig(
    MotorLink, _AngularSpeed, _AngularAcceleration, _AngularSpeed,
    port=_Word, baud=_Baud, timeout=_Time, start=_Time, watchdog=_Time,
)  # fmt: skip

"""What a rig file says of a device, by its kind: a model of the fields of each one's settings, and what it becomes."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeVar
from zlib import crc32

import jax.numpy as jnp
import numpy as np
from pydantic import Field, PlainValidator, WithJsonSchema, create_model

from nectosome.description.base import Name
from nectosome.description.fields import (
    Angle,
    AngularSpeed,
    PositiveAngularSpeed,
    PositiveFrequency,
    PositiveNumber,
    PositiveTime,
    Voltage,
)
from nectosome.io.schema.described import Described, Text, unfit
from nectosome.io.schema.quantity import Quantity
from nectosome.io.schema.validate import line_of
from nectosome.io.yaml_text import Key
from nectosome.units import InputError, count

from .actuator_bench import actuator_loop
from .channel_units import AnyQuantity
from .dynamixel import Bus, Dynamixel, Servo
from .guards import CommandLimits, MeasurementLimits
from .imu import IMU, MPU6050, SerialIMU
from .ni import Input, NationalInstruments, Output, Watchdog, Wiring, per_volt
from .rig import Rig
from .serial_line import SerialLink
from .serial_motor import MotorLink, SerialMotor
from .simulated_rig import SimulatedRig
from .simulated_robot import ReadingSensor, RobotSettings, simulated_robot

if TYPE_CHECKING:
    from nectosome.identification.hysteresis.fit import Identified

_Created = TypeVar("_Created")
_Word = Annotated[str, Field(min_length=1)]
_Baud = Annotated[int, Field(ge=300, le=10_000_000)]
_Attempts = Annotated[int, Field(ge=1, le=100)]
Count = Annotated[int, Field(ge=1, le=1_000_000)]


@dataclass(frozen=True)
class FileFields:
    """A file and a group of its fields, for the errors of what is made of them."""

    source: str
    lines: Mapping[Key, int]
    at: Key = ()

    @property
    def folder(self) -> Path:
        """The folder of the file."""
        return Path(self.source).parent

    def within(self, *steps: str | int) -> "FileFields":
        """A group further in."""
        return FileFields(self.source, self.lines, (*self.at, *steps))

    def wrong(self, message: str, *steps: str | int) -> InputError:
        """The error of a field."""
        at = (*self.at, *steps)
        return InputError(message, file=self.source, line=line_of(at, self.lines), field=".".join(map(str, at)) or None)

    def create(self, kind: Callable[..., _Created], group: Any, **given: Any) -> _Created:
        """A dataclass from the fields of a group, and others that are given; its errors are those of their fields."""
        names = [name for name in inspect.signature(kind).parameters if name not in given]
        with self.errors():
            return kind(**{name: getattr(group, name) for name in names}, **given)

    @contextmanager
    def errors(self) -> Iterator[None]:
        """Errors of what is made here are those of the fields that they name."""
        try:
            yield
        except InputError as error:
            raise self.wrong(error.message, *error.field.split(".") if error.field else ()) from None


class DeviceDescription(Described):
    """A device of a rig: what it is connected to, by its kind."""

    kind: Any  # its name in a file, a literal of each class


def model_of_settings(settings: type, base: type[Described] = Described, name: str = "", /, **types: Any) -> Any:
    """Model of a group of fields for a dataclass, with the same defaults; `types` has those of its fields.

    A type with another default is a pair; a field whose type is None is no field of the file.
    """
    known: dict[str, Any] = {}
    for field in fields(settings):
        of = types.pop(field.name, field.type)
        if of is not None:
            known[field.name] = of if isinstance(of, tuple) else (of, _default(field))
    model = create_model(name or settings.__name__, __base__=base, __doc__=settings.__doc__, **known, **types)
    model.described_in = settings
    return model


def _default(field: Any) -> Any:
    if field.default_factory is not MISSING:
        return Field(default_factory=field.default_factory)
    return ... if field.default is MISSING else field.default


def _device(kind: str, settings: type, **types: Any) -> Any:
    return model_of_settings(settings, DeviceDescription, kind=(Literal[kind], ...), **types)


@dataclass(frozen=True)
class Simulation:
    """A simulated actuator, from `pressure` to `displacement`: a saved model, or the numbers of a linear one."""

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


_Gain = Annotated[float, Quantity("length_per_pressure", minimum=0, exclusive=True)]
_Frequency = Annotated[float, Quantity("angular_speed", minimum=0, exclusive=True)]
_Noise = Annotated[float, Quantity("length", minimum=0)]
SIMULATED = _device(
    "simulated", Simulation,
    model=_Word | None, gain=_Gain | None, frequency=_Frequency | None, damping=PositiveNumber, noise=_Noise | None,
)  # fmt: skip


def _per_volt(value: Any) -> str:
    """The text of a slope."""
    try:
        per_volt(str(value))
    except InputError as error:
        raise unfit(error.message) from None
    return str(value)


_Slope = Annotated[
    str, PlainValidator(_per_volt), WithJsonSchema({"type": "string", "examples": ["0.2 bar/V", "46.5 N/V"]})
]
_volts = {"channel": _Word, "zero": Voltage, "slope": _Slope, "unit": None, "low": Voltage, "high": Voltage}
_OUTPUT, _INPUT = model_of_settings(Output, **_volts), model_of_settings(Input, **_volts)
_WATCHDOG = model_of_settings(Watchdog, device=_Word, timeout=PositiveTime)
_DEVICES = Annotated[tuple[_OUTPUT, ...], Field(min_length=1)]
NI = _device(
    "ni", Wiring, outputs=dict[Name, _DEVICES], inputs=dict[Name, _INPUT], watchdog=_WATCHDOG | None
)  # fmt: skip
_SERVO = model_of_settings(
    Servo, number=Annotated[int, Field(ge=0, le=252)], zero=Angle, sign=Literal[1, -1], speed=AngularSpeed
)
DYNAMIXEL = _device(
    "dynamixel", Bus,
    port=_Word, servos=Annotated[dict[Name, _SERVO], Field(min_length=1)], baud=_Baud, watchdog=PositiveTime,
    record=tuple[Literal["speed", "current", "voltage", "temperature"], ...],
)  # fmt: skip
_link = {"port": _Word, "baud": _Baud, "timeout": PositiveTime, "start": PositiveTime, "attempts": _Attempts}
SERIAL = _device("serial", MotorLink, **_link, watchdog=PositiveTime)
SERIAL_IMU = _device("serial_imu", SerialLink, **_link)
INERTIAL = _device(
    "imu", MPU6050,
    bus=Annotated[int, Field(ge=0, le=1000)], address=Literal[0x68, 0x69],
    acceleration=Annotated[float, Quantity("acceleration")], rate=PositiveAngularSpeed, bandwidth=PositiveFrequency,
)  # fmt: skip

_NONE = AnyQuantity, "0"
_SENSOR = model_of_settings(ReadingSensor, reading=_Word, noise=_NONE, resolution=_NONE, delay=_NONE, range=str | None)
ROBOT = _device(
    "robot", RobotSettings,
    robot=_Word, commands=dict[Name, _Word], measurements=Annotated[dict[Name, _SENSOR], Field(min_length=1)],
    set=dict[str, Text] | None, seed=Annotated[int, Field(ge=0, le=1_000_000)], time_step=PositiveTime | None,
)  # fmt: skip


def made_device(given: Any, file: FileFields, dt: float) -> Rig | None:
    """The device of a group of fields, dt [s] between samples; None for a simulated actuator: it needs its limits."""
    makers = {"ni": _ni, "dynamixel": _dynamixel, "serial": _serial, "robot": _robot}
    makers |= {"imu": _imu, "serial_imu": _serial_imu}
    return makers[given.kind](given, file, dt) if given.kind in makers else None


def _ni(given: Any, file: FileFields, dt: float) -> Rig:
    def create(kind: Any, group: Any, *at: str | int) -> Any:
        slope, unit = per_volt(group.slope)
        return file.within(*at).create(kind, group, slope=slope, unit=unit)

    outputs = {
        name: tuple(create(Output, one, "outputs", name, k) for k, one in enumerate(group))
        for name, group in given.outputs.items()
    }
    inputs = {name: create(Input, group, "inputs", name) for name, group in given.inputs.items()}
    watchdog = given.watchdog and file.within("watchdog").create(Watchdog, given.watchdog)
    if watchdog:
        outlasts(file, watchdog.timeout, dt, "watchdog", "timeout")
    return NationalInstruments(file.create(Wiring, given, outputs=outputs, inputs=inputs, watchdog=watchdog))


def _dynamixel(given: Any, file: FileFields, dt: float) -> Rig:
    outlasts(file, given.watchdog, dt, "watchdog")
    servos = {name: file.within("servos", name).create(Servo, group) for name, group in given.servos.items()}
    return Dynamixel(file.create(Bus, given, servos=servos))


def _serial(given: Any, file: FileFields, dt: float) -> Rig:
    outlasts(file, given.watchdog, dt, "watchdog")
    asked = given.attempts * given.timeout
    if given.watchdog <= asked:
        raise file.wrong(
            f"{given.watchdog:g} s, and a question may take {asked:g} s ({count(given.attempts, 'attempt')} of "
            f"{given.timeout:g} s): the controller would stop by itself while it is asked again. Take more than "
            f"{asked:g} s, or a shorter timeout.",
            "watchdog",
        )
    return SerialMotor(file.create(MotorLink, given))


def _imu(given: Any, file: FileFields, dt: float) -> Rig:
    return IMU(file.create(MPU6050, given))


def _serial_imu(given: Any, file: FileFields, dt: float) -> Rig:
    return SerialIMU(file.create(SerialLink, given))


def _robot(given: Any, file: FileFields, dt: float) -> Rig:
    sensors = {
        name: file.within("measurements", name).create(ReadingSensor, group)
        for name, group in given.measurements.items()
    }
    settings = file.create(RobotSettings, given, measurements=sensors)
    with file.errors():
        return simulated_robot(settings, file.folder, dt)


ACTUATOR = {"pressure": "Pa"}, {"displacement": "m"}
"""Command and measurement of a simulated actuator."""


def simulated_actuator(
    given: Any, file: FileFields, limits: CommandLimits, measured: MeasurementLimits, dt: float
) -> "tuple[Rig, Identified]":
    """A simulated actuator with its valve, which keeps to the limits of the command, and its model.

    Its sensor sees beyond the limits of the measurement, so that guards find what leaves them, and has a noise of its
    own by the name of the device.
    """
    model = _model(given, file, limits)
    loop, pace = actuator_loop(model, limits, measured, dt, given.noise), "real" if given.real_time else "virtual"
    seed = jnp.asarray(crc32(str(file.at).encode()))
    sensor = replace(loop.sensor, low=jnp.asarray(-jnp.inf), high=jnp.asarray(jnp.inf), seed=seed)
    return SimulatedRig(loop.plant, sensor, dt=dt / loop.substeps, pace=pace), model


def _model(given: Any, file: FileFields, limits: CommandLimits) -> "Identified":
    """The model of a simulated actuator: saved, or linear, without hysteresis."""
    from nectosome.identification.hysteresis.files import saved_model
    from nectosome.identification.hysteresis.fit import Identified
    from nectosome.io import load_dataset

    linear = {name: getattr(given, name) for name in ("gain", "frequency")}
    if given.model is None:
        for name, value in linear.items():
            if value is None:
                raise file.wrong("is missing: give model, or gain and frequency.", name)
        theta = {"frequency": given.frequency, "damping": given.damping}
        return Identified(theta, {}, np.array([limits.high - limits.low]), np.full(2, given.gain), 0.0, 2, ())
    for name, value in linear.items():
        if value is not None:
            raise file.wrong("belongs to a linear model: leave it or model out.", name)
    try:
        return saved_model(load_dataset(file.folder / given.model), given.model)
    except InputError as error:
        raise file.wrong(str(error), "model") from None


def outlasts(file: FileFields, watchdog: float, dt: float, *at: str) -> None:
    """Check that a watchdog waits longer than the time between samples. Raises InputError."""
    if watchdog <= dt:
        message = f"{watchdog:g} s, and dt is {dt:g} s: it would act between two samples. Take several times dt."
        raise file.wrong(message, *at)

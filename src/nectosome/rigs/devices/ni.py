"""Analogue outputs and inputs of National Instruments cards, such as valves, lasers, load cells, through NI-DAQmx."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

from pydantic import Field, PlainValidator, WithJsonSchema

from nectosome.description.fields import Name, PositiveTime, Voltage
from nectosome.io.schema.described import unfit
from nectosome.units import InputError

from ..device_files import FileFields, Word, device_model, model_of_settings, outlasts, slope_per
from ..rig import FileZero, Rig, RigError, driver, each, one_line

_WIDEST = 10.0  # range of cards [V]


def per_volt(text: str) -> tuple[float, str]:
    """Slope in SI, and the SI unit of what is commanded or measured: (46.5, "N") of "46.5 N/V".

    Raises InputError where it is not a number with a unit per volt.
    """
    return slope_per("volt", text, 'Something per volt is expected, as in "0.2 bar/V", "46.5 N/V" or "2 mm/mV".')


@dataclass(frozen=True)
class Output:
    """A device that follows volts, such as a pressure valve.

    A Festo VPPI of -1 to 1 bar over 0 to 10 V has its zero at 5 V and gives 0.2 bar/V: `Output("Dev1/ao0", 5.0, 2e4,
    "Pa")`. One that works against it has the opposite slope.
    """

    channel: str
    """Analogue output of the card, as in Dev1/ao0."""
    zero: float  # [V]
    """Volts at a command of 0."""
    slope: float
    """Command per volt, in SI; negative for a device that works against the others."""
    unit: str
    """SI unit of the command."""
    low: float = 0.0  # [V]
    """Smallest volts that the device takes."""
    high: float = 10.0  # [V]
    """Largest volts that the device takes."""

    def __post_init__(self):
        if not (0 < abs(self.slope) < math.inf and self.low <= self.zero <= self.high):
            volts = f"{self.slope:g} {self.unit}/V from {self.zero:g} V, within {self.low:g} to {self.high:g} V"
            raise InputError(f"{self.channel}: {volts}. The slope must not be 0, the volts at a command of 0 within.")

    def volts(self, command: float) -> float:
        """Volts for a command, in its unit."""
        volts = self.zero + command / self.slope
        if not self.low <= volts <= self.high:  # nor where it is NaN
            ends = sorted((end - self.zero) * self.slope for end in (self.low, self.high))
            raise RigError(
                f"{self.channel}: a command of {command:g} {self.unit} would be {volts:g} V, which is not within"
                f" {self.low:g} to {self.high:g} V. Keep commands within {ends[0]:g} to {ends[1]:g} {self.unit}."
            )
        return volts


@dataclass(frozen=True)
class Input:
    """A sensor that gives volts, such as a laser or the amplifier of a load cell; out of its range it sees nothing."""

    channel: str
    """Analogue input of the card, as in Dev1/ai0."""
    zero: float  # [V]
    """Volts where the measurement is 0."""
    slope: float
    """Measurement per volt, in SI."""
    unit: str
    """SI unit of the measurement."""
    low: float = -_WIDEST  # [V]
    """Smallest volts of its range; below it sees nothing."""
    high: float = _WIDEST  # [V]
    """Largest volts of its range; above it sees nothing."""

    def __post_init__(self):
        if not (0 < abs(self.slope) < math.inf and math.isfinite(self.zero) and self.low < self.high):
            volts = f"{self.slope:g} {self.unit}/V from {self.zero:g} V, within {self.low:g} to {self.high:g} V"
            raise InputError(f"{self.channel}: {volts}. The slope must not be 0, and the range not empty.")

    def measured(self, volts: float) -> float:
        """Measurement in its unit; NaN out of range."""
        return self.slope * (volts - self.zero) if self.low <= volts <= self.high else math.nan


@dataclass(frozen=True)
class Watchdog:
    """The card's own: without a command for some time it puts its outputs to commands of 0, and locks them."""

    device: Word
    """The device, as in cDAQ1."""
    timeout: PositiveTime  # [s]
    """Time without a command after which it acts; several times dt."""


@dataclass(frozen=True)
class Wiring:
    """Outputs and inputs of National Instruments cards: what is connected to which channel."""

    outputs: Mapping[str, Sequence[Output]] = field(default_factory=dict)
    """Devices of each command, which they all get, each by its own slope."""
    inputs: Mapping[str, Input] = field(default_factory=dict)
    """The sensor of each measurement."""
    watchdog: Watchdog | None = None
    """The card's own watchdog, where it has one."""

    def __post_init__(self):
        if not self.outputs and not self.inputs:
            raise InputError("there are neither outputs nor inputs.")
        for name, devices in self.outputs.items():
            if not devices:
                raise InputError("there are none.", field=f"outputs.{name}")
            for k, device in enumerate(devices):
                if device.unit != devices[0].unit:
                    message = f"{device.unit} of {device.channel}, and {devices[0].unit} of {devices[0].channel}."
                    raise InputError(f"one command has one unit: {message}", field=f"outputs.{name}.{k}.slope")
        devices = [*self.devices(), *self.inputs.values()]
        channels = [device.channel for device in devices]
        for channel in channels:
            if channels.count(channel) > 1:
                raise InputError(f"{channel} is used twice. Give each its own channel.")
        if self.watchdog and not self.outputs:
            raise InputError("there are no outputs to watch.", field="watchdog")

    def devices(self) -> list[Output]:
        """All outputs."""
        return [device for devices in self.outputs.values() for device in devices]


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
_volts = {"channel": Word, "zero": Voltage, "slope": _Slope, "unit": None, "low": Voltage, "high": Voltage}
_OUTPUT, _INPUT = model_of_settings(Output, **_volts), model_of_settings(Input, **_volts)
_OUTPUTS = Annotated[tuple[_OUTPUT, ...], Field(min_length=1)]


class NationalInstruments(Rig):
    """Commands on outputs, measurements of inputs, which are read at once. Without outputs it is a sensor.

    Not every card has a watchdog of analogue outputs: `open` tells. `module` takes the place of `nidaqmx`.
    """

    name = "National Instruments"
    described_by = device_model(
        "ni",
        Wiring,
        outputs=dict[Name, _OUTPUTS],
        inputs=dict[Name, _INPUT],
        watchdog=model_of_settings(Watchdog) | None,
    )

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "NationalInstruments":
        """Raises InputError for a watchdog that acts between two samples."""

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
        return cls(file.create(Wiring, given, outputs=outputs, inputs=inputs, watchdog=watchdog))

    def __init__(self, wiring: Wiring, module: Any = None):
        self.wiring = wiring
        self.commands = {name: devices[0].unit for name, devices in wiring.outputs.items()}
        self.measurements = {name: sensor.unit for name, sensor in wiring.inputs.items()}
        self._daq, self.commanded = module, False
        self._tasks: list[tuple[str, Any]] = []  # all there are, by what they are for
        self._drivers: dict[str, Any] = {}  # tasks of outputs, by channel
        self._input: Any = None
        self._watchdog: Any = None
        self._connected = self._opened = False

    def connect(self) -> None:
        """One task for all inputs; outputs keep what they have."""
        self._load()
        self._listen()
        self._connected = True

    def open(self) -> None:
        """Tasks for all channels, and commands of 0."""
        self._load()
        if self.wiring.watchdog is not None:
            hint = " Not every device can watch analogue outputs: where it cannot, leave the watchdog out."
            with self._driver_errors(f"watchdog of {self.wiring.watchdog.device}", hint):
                self._watch(self.wiring.watchdog)
        for device in self.wiring.devices():
            with self._driver_errors(device.channel):
                task = self._kept(device.channel, self._daq.Task())
                task.ao_channels.add_ao_voltage_chan(device.channel, min_val=device.low, max_val=device.high)
                task.start()
                self._drivers[device.channel] = task
        self._opened = True
        zeros = [0.0] * len(self.commands)
        self.write(zeros)
        self._listen()
        self._connected = True
        self.write(zeros)  # the watchdog may be short, and making tasks takes time

    def _load(self) -> None:
        if self._daq is None:
            self._daq = driver("nidaqmx", "rig")
            driver("nidaqmx.system.watchdog", "rig")

    def _listen(self) -> None:
        if not self.wiring.inputs:
            return
        with self._driver_errors(self._inputs()):
            task = self._kept(self._inputs(), self._daq.Task())
            for sensor in self.wiring.inputs.values():
                # the widest range of the card: else it would hide that a sensor is out of its own
                task.ai_channels.add_ai_voltage_chan(sensor.channel, min_val=-_WIDEST, max_val=_WIDEST)
            task.start()
            self._input = task

    def _inputs(self) -> str:
        return ", ".join(sensor.channel for sensor in self.wiring.inputs.values())

    def _watch(self, watchdog: Watchdog) -> None:
        make = self._daq.system.watchdog.WatchdogTask
        task = self._kept("watchdog of the card", make(watchdog.device, timeout=watchdog.timeout))
        kind = self._daq.constants.WatchdogAOExpirState.VOLTAGE
        state = self._daq.types.AOExpirationState
        rest = [state(device.channel, device.volts(0.0), kind) for device in self.wiring.devices()]
        task.cfg_watchdog_ao_expir_states(rest)
        task.start()
        self._watchdog = task
        self._unlock()  # a run that was killed may have left outputs locked

    def _unlock(self) -> None:
        if self._watchdog.expired:
            self._watchdog.clear_expiration()

    def _kept(self, what: str, task: Any) -> Any:
        self._tasks.append((what, task))
        return task

    def measure(self) -> tuple[float, ...]:
        """The measurements; NaN where a sensor is out of its range."""
        if not self._connected:
            raise RigError(f"{self._inputs() or self.name}: read before it was opened.")
        if self._input is None:
            return ()
        with self._driver_errors(self._inputs()):
            told = self._input.read()
        sensors = self.wiring.inputs.values()
        volts = told if len(sensors) > 1 else [told]  # the driver gives no list of one
        return tuple(sensor.measured(float(v)) for sensor, v in zip(sensors, volts, strict=True))

    def write(self, commands: Sequence[float]) -> None:
        """Volts to every output, after which the watchdog waits anew."""
        every = self._volts(commands)  # of all, before one of them moves
        if not self._opened:
            raise RigError(f"{', '.join(every) or self.name}: written before it was opened.")
        self.commanded |= bool(every)
        try:
            for channel, volts in every.items():
                with self._driver_errors(channel):
                    self._drivers[channel].write(volts)
            if self._watchdog is not None:
                with self._driver_errors("watchdog of the card"):
                    self._watchdog.reset_timer()
        except RigError as error:
            self._explain_expired(error)
            raise

    def _volts(self, commands: Sequence[float]) -> dict[str, float]:
        """Volts of each channel."""
        pairs = zip(self.wiring.outputs.values(), commands, strict=True)
        return {device.channel: device.volts(command) for devices, command in pairs for device in devices}

    def check_command(self, name: str, command: float) -> None:
        """Raise RigError for a command that one of its devices cannot follow."""
        for device in self.wiring.outputs[name]:
            device.volts(command)

    def zero_of(self, name: str) -> FileZero:
        """That of the sensor."""
        sensor = self.wiring.inputs[name]
        return FileZero(("inputs", name), sensor.zero, sensor.slope, "V", sloped=True)

    def _explain_expired(self, error: RigError) -> None:
        """Raise an error that says so, if it was the watchdog that made a command fail."""
        watchdog = self.wiring.watchdog
        with suppress(self._daq.errors.Error, OSError):
            if watchdog and self._watchdog and self._watchdog.expired:
                raise RigError(
                    f"watchdog of {watchdog.device}: it has put the outputs to commands of 0, since none came for "
                    f"{watchdog.timeout:g} s. Look at what holds up the loop."
                ) from error

    def vent(self) -> None:
        """Commands of 0 to every output, whatever becomes of the others."""
        rest = {device.channel: device.volts(0.0) for device in self.wiring.devices()}
        zeros = [(channel, partial(task.write, rest[channel])) for channel, task in self._drivers.items()]
        first = [] if self._watchdog is None else [("watchdog of the card", self._unlock)]
        each(partial(self._step, what, step) for what, step in [*first, *zeros])

    def close(self) -> None:
        """Clear all tasks; outputs keep their volts."""
        steps = [(what, task.close) for what, task in self._tasks]
        self._tasks, self._drivers, self._input, self._watchdog = [], {}, None, None
        self._connected = self._opened = False
        each(partial(self._step, what, step) for what, step in steps)

    def _step(self, what: str, step: Callable[[], Any]) -> None:
        with self._driver_errors(what):
            step()

    @contextmanager
    def _driver_errors(self, what: str, hint: str = "") -> Iterator[None]:
        """Errors of the driver become RigError."""
        errors = self._daq.errors
        try:
            yield
        except (errors.DaqNotFoundError, errors.DaqNotSupportedError) as error:
            raise RigError(
                f"{what}: the NI-DAQmx driver does not work on this machine ({one_line(error)}). nidaqmx only speaks to"
                " it: install it with `python -m nidaqmx installdriver`, or from ni.com/downloads."
            ) from error
        except (errors.Error, OSError) as error:
            raise RigError(
                f"{what}: {one_line(error)}. Look in NI MAX or NI Hardware Configuration Utility whether the device is"
                f" there under this name, and whether another program holds the channel.{hint}"
            ) from error

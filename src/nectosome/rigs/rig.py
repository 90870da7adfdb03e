"""The contract of rigs: commands in, measurements out, a clock, and a safe stop.

Rigs of devices share the import of their drivers, the errors of serial lines, and repeated attempts.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EACCES, EPERM
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from nectosome.io import extras
from nectosome.units import InputError

if TYPE_CHECKING:
    from .device_files import FileFields
    from .guards import CommandLimits, MeasurementLimits


try:
    from termios import error as terminal_error  # not caught by pyserial, and no OSError
except ImportError:  # on Windows
    terminal_error = OSError


class RigError(Exception):
    """A fault of a rig; the message names the rig and what to check."""


class FileZero(NamedTuple):
    """Where a device has the zero of a measurement in a rig file: quantity = slope (raw - zero)."""

    group: tuple[str, ...]
    """Steps from the device to the group with the field `zero`."""
    zero: float
    """In `raw_unit`."""
    slope: float
    """SI per `raw_unit`."""
    raw_unit: str
    sloped: bool = False
    """Whether the group has a field `slope` that may be changed."""


class Rig(ABC):
    """Devices with commands and measurements; `tests/rigs/test_contract.py` holds every rig to it.

    Commands and measurements have names and SI units, and stand in the order of `commands` and `measurements`. A
    sensor has no commands. A command may have the name of a measurement, such as the angle of a servo. A command of 0
    is a safe state. Any method may raise RigError, and no other error for faults of the device or its line.
    """

    name: str
    commands: Mapping[str, str]  # name, and SI unit such as N m or m/s2
    measurements: Mapping[str, str]
    described_by: ClassVar[Any]
    """Model of what a rig file says of it, a `device_model`."""
    commanded: bool = True
    """Whether a command may have reached a device: where none has, a rig that cannot be opened is no danger."""

    @classmethod
    def from_description(cls, given: Any, file: "FileFields", dt: float) -> "Rig":
        """The device of fields of a rig file, dt [s] between samples; if nothing else is defined, of its settings.

        Raises InputError.
        """
        return cls(file.create(cls.described_by.described_in, given))  # pyright: ignore[reportCallIssue]

    def take_limits(  # noqa: B027  most keep to none
        self, commands: "Mapping[str, CommandLimits]", measurements: "Mapping[str, MeasurementLimits]"
    ) -> None:
        """Limits of its own channels in a rig file, for a simulated device that keeps to them. Raises InputError."""

    @abstractmethod
    def open(self) -> None:
        """Connect, with commands of 0."""

    @abstractmethod
    def connect(self) -> None:
        """Connect to measure only, until `close`: no command, torque or voltage is put on, and `write` is an error."""

    @abstractmethod
    def measure(self) -> tuple[float, ...]:
        """The present measurements; NaN where a sensor has none."""

    @abstractmethod
    def write(self, commands: Sequence[float]) -> None:
        """Send all commands; the devices hold them until the next ones."""

    def check_command(self, name: str, command: float) -> None:  # noqa: B027  many take all that is finite
        """Raise RigError for a command that the device cannot take; nothing is sent, in any state."""

    def zero_of(self, name: str) -> FileZero | None:
        """Zero of a measurement in a rig file; None where it has none there."""
        return None

    def put_on(self, name: str, load: float) -> bool:
        """Put a known load [SI] on a simulated sensor, where it stays; False on a real rig: a person puts it on."""
        return False

    def remarks(self) -> list[str]:
        """What it got over since it was opened, such as damaged lines, in sentences for a log; kept when closed."""
        return []

    @abstractmethod
    def vent(self) -> None:
        """Take all power out, in any state: the last step of every run; may be called again."""

    @abstractmethod
    def close(self) -> None:
        """Release the device; may be called again, and after `open` has failed."""

    def now(self) -> float:
        """Time [s] of a monotonic clock."""
        return time.perf_counter()

    def wait(self, until: float) -> None:
        """Wait until `now()` is at least `until` [s]."""
        left = until - time.perf_counter()
        if left > 0:
            time.sleep(left)


class SensorRig(Rig):
    """A device without commands: it is opened to measure only."""

    commands: Mapping[str, str] = {}
    commanded = False

    def open(self) -> None:
        """As `connect`."""
        self.connect()

    def write(self, commands: Sequence[float]) -> None:
        """There are none."""

    def vent(self) -> None:
        """Nothing is driven."""


def driver(name: str, extra: str) -> Any:
    """A module that comes with an extra of this package. Raises RigError where it is missing."""
    try:
        return extras.package(name, extra)
    except InputError as error:
        raise RigError(str(error)) from error


@contextmanager
def line(device: str) -> Iterator[None]:
    """Errors of a serial line, or its absence, become RigError."""
    try:
        yield
    except (OSError, terminal_error, ValueError) as error:
        hint = "Look at the port's name, the cable, the power, and whether another program uses the port."
        if getattr(error, "errno", None) in (EACCES, EPERM):
            hint = "This user may not use the port: on Linux its group, mostly dialout, must have the user as a member."
        raise RigError(f"{device}: the line does not work ({one_line(error)}). {hint}") from error


def retried(step: Callable[[], object], otherwise: str) -> None:
    """Try a step up to three times; `otherwise` is what a person must do if it fails."""
    for left in (2, 1, 0):
        try:
            step()
            return
        except RigError as error:
            if not left:
                raise RigError(f"{error} {otherwise}") from error


def each(steps: Iterable[Callable[[], object]]) -> None:
    """Take all steps; then raise the faults of those that failed, as one, or the first error that is none."""
    errors = list[Exception]()
    for step in steps:
        try:
            step()
        except Exception as error:
            errors.append(error)
    for error in errors:
        if not isinstance(error, RigError):
            raise error
    if errors:
        raise RigError(" ".join(map(str, errors))) from errors[0]


def one_line(error: object) -> str:
    """A message without line breaks and full stop."""
    return " ".join(str(error).split()).rstrip(".")


class Devices(Rig):
    """Devices by name, opened, measured, written and closed in their order; a fault of one leaves none out of a vent.

    Time is that of the first one's clock: a device in virtual time goes with none in real time.
    """

    def __init__(self, devices: Mapping[str, Rig], name: str = ""):
        self.devices = dict(devices)
        self.name = name or ", ".join(dict.fromkeys(device.name for device in devices.values()))
        self.commands = _joined({key: device.commands for key, device in devices.items()})
        self.measurements = _joined({key: device.measurements for key, device in devices.items()})

        self.commanded = False

    def open(self) -> None:
        """Connect them; those after one that fails are not opened."""
        tried = list[Rig]()
        try:
            for device in self.devices.values():
                tried.append(device)
                device.open()
        finally:
            self.commanded = any(device.commanded for device in tried)

    def connect(self) -> None:
        """Connect them to measure only."""
        for device in self.devices.values():
            device.connect()

    def measure(self) -> tuple[float, ...]:
        """The measurements of all, one device after the other."""
        return tuple(value for device in self.devices.values() for value in device.measure())

    def write(self, commands: Sequence[float]) -> None:
        """The commands of all; those after one that fails get none."""
        self.commanded, begin = True, 0
        for device in self.devices.values():
            end = begin + len(device.commands)
            if device.commands:
                device.write(commands[begin:end])
            begin = end

    def vent(self) -> None:
        """Take the power out of all, whatever becomes of the others."""
        each(device.vent for device in self.devices.values())

    def close(self) -> None:
        """Release all, whatever becomes of the others."""
        each(device.close for device in self.devices.values())

    def put_on(self, name: str, load: float) -> bool:
        """On a sensor of one of them."""
        device, _, channel = name.partition(".")
        return self.devices[device].put_on(channel, load)

    def remarks(self) -> list[str]:
        """Those of all."""
        return [remark for device in self.devices.values() for remark in device.remarks()]

    def now(self) -> float:
        """Time of the first device."""
        return self._first.now()

    def wait(self, until: float) -> None:
        """Wait by the clock of the first device; the others follow it."""
        for device in self.devices.values():
            device.wait(until)

    @property
    def _first(self) -> Rig:
        return next(iter(self.devices.values()))


def _joined(channels: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    return {f"{key}.{name}": unit for key, own in channels.items() for name, unit in own.items()}

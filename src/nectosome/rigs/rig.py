"""The contract of rigs: commands in, measurements out, a clock, and a safe stop.

Rigs of devices share the import of their drivers, the errors of serial lines, and repeated attempts.
"""

import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from errno import EACCES, EPERM
from typing import TYPE_CHECKING, Any, ClassVar

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


def one_line(error: object) -> str:
    """A message without line breaks and full stop."""
    return " ".join(str(error).split()).rstrip(".")

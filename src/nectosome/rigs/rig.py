"""The contract of rigs: one command in, one measurement out, a clock, and a safe stop."""

import time
from abc import ABC, abstractmethod


class RigError(Exception):
    """A fault of a rig; the message names the rig and what to check."""


class Rig(ABC):
    """A device with a command and a measurement; `tests/rigs/test_contract.py` holds every rig to it.

    Commands and measurements are in SI units. Any method may raise RigError, and no other error for faults of the
    device or its line.
    """

    name: str
    command_unit: str  # SI, as pint reads it
    measured_unit: str

    @abstractmethod
    def open(self) -> None:
        """Connect, with a command of 0."""

    @abstractmethod
    def measure(self) -> float:
        """The present measurement; NaN where the sensor has none."""

    @abstractmethod
    def write(self, command: float) -> None:
        """Send a command; the device holds it until the next one."""

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

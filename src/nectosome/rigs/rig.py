"""The contract of rigs: one command in, one measurement out, a clock, and a way to stop."""

import time
from abc import ABC, abstractmethod


class RigError(Exception):
    """A rig does not do what it should; the message says which, and what to look at."""


class Rig(ABC):
    """What an experiment moves; `tests/rigs/test_contract.py` holds every rig to it.

    Commands and measurements are in SI units. Any method may raise RigError, and only this for what a device or its
    line does wrong.
    """

    name: str
    command_unit: str  # SI, as pint reads it
    measured_unit: str

    @abstractmethod
    def open(self) -> None:
        """Connect, and stand at a command of 0."""

    @abstractmethod
    def read(self) -> float:
        """The measurement now; NaN where the sensor says that it has none."""

    @abstractmethod
    def write(self, command: float) -> None:
        """A command, held until the next."""

    @abstractmethod
    def vent(self) -> None:
        """Take all power out, whatever stands: the last thing done on every way out; may be called again."""

    @abstractmethod
    def close(self) -> None:
        """Let go of the device; may be called again, and where `open` has failed."""

    def now(self) -> float:
        """Time [s] of a clock that only goes forward."""
        return time.perf_counter()

    def wait(self, until: float) -> None:
        """Let time pass until `now()` is at least `until`."""
        left = until - time.perf_counter()
        if left > 0:
            time.sleep(left)

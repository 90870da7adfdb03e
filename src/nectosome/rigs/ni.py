"""Valves on analogue outputs and a laser on an analogue input of a National Instruments card, through NI-DAQmx."""

import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

from nectosome.units import InputError

from .rig import Rig, RigError, driver, one_line


@dataclass(frozen=True)
class Valve:
    """A pressure valve that follows volts.

    A Festo VPPI of -1 to 1 bar over 0 to 10 V has its zero at 5 V and gives 0.2 bar/V: `Valve("Dev1/ao0", 5.0, 2e4)`.
    One that works against it has the opposite slope.
    """

    channel: str
    """Analogue output of the card, as in Dev1/ao0."""
    zero: float  # [V]
    """Volts at a command of 0."""
    slope: float  # [Pa/V]
    """Pressure per volt; negative for a valve that works against the others."""
    low: float = 0.0  # [V]
    """Smallest volts that the valve takes."""
    high: float = 10.0
    """Largest volts that the valve takes."""

    def __post_init__(self):
        if not (0 < abs(self.slope) < math.inf and self.low <= self.zero <= self.high):
            volts = f"{self.slope:g} Pa/V from {self.zero:g} V, within {self.low:g} to {self.high:g} V"
            raise InputError(f"{self.channel}: {volts}. The slope must not be 0, the volts at a command of 0 within.")

    def volts(self, command: float) -> float:
        """Volts for a command [Pa]."""
        volts = self.zero + command / self.slope
        if not self.low <= volts <= self.high:  # nor where it is NaN
            ends = sorted((end - self.zero) * self.slope for end in (self.low, self.high))
            raise RigError(
                f"{self.channel}: a command of {command:g} Pa would be {volts:g} V, which is not within {self.low:g} to"
                f" {self.high:g} V. Keep commands within {ends[0]:g} to {ends[1]:g} Pa."
            )
        return volts


@dataclass(frozen=True)
class Laser:
    """A distance sensor that gives volts, as a Keyence IL-065; beyond its range it sees nothing."""

    channel: str
    """Analogue input of the card, as in Dev1/ai0."""
    zero: float  # [V]
    """Volts where the measurement is 0."""
    slope: float  # [m/V]
    """Displacement per volt."""
    low: float  # [V]
    """Smallest volts of its range; below it sees nothing."""
    high: float
    """Largest volts of its range; above it sees nothing."""

    def __post_init__(self):
        if not (0 < abs(self.slope) < math.inf and self.low < self.high):
            volts = f"{self.slope:g} m/V within {self.low:g} to {self.high:g} V"
            raise InputError(f"{self.channel}: {volts}. The slope must not be 0, and the range not empty.")

    def measured(self, volts: float) -> float:
        """Distance [m]; NaN out of range."""
        return self.slope * (volts - self.zero) if self.low <= volts <= self.high else math.nan


@dataclass(frozen=True)
class Watchdog:
    """The card's own: without a command for some time it puts its outputs to a command of 0, and locks them."""

    device: str
    """The device, as in cDAQ1."""
    timeout: float
    """Time without a command after which it acts; several times dt."""


@dataclass(frozen=True)
class Wiring:
    """Valves and a laser on a National Instruments card: what is connected to which channel."""

    valves: tuple[Valve, ...]
    """The valves. All get the same command, each by its own slope."""
    laser: Laser
    """The sensor of the displacement."""
    watchdog: Watchdog | None = None
    """The card's own watchdog, where it has one."""


class NationalInstruments(Rig):
    """Pressure [Pa] in, displacement [m] out. Not every card has a watchdog of analogue outputs: `open` tells.

    `module` takes the place of `nidaqmx`.
    """

    name = "National Instruments"
    command_unit = "Pa"
    measured_unit = "m"

    def __init__(self, wiring: Wiring, module: Any = None):
        self.wiring = wiring
        self._daq, self.commanded = module, False
        self._tasks: list[tuple[str, Any]] = []  # all there are, by what they are for
        self._outputs: list[tuple[Valve, Any]] = []  # those that drive
        self._input: Any = None
        self._watchdog: Any = None

    def open(self) -> None:
        """Tasks for each channel, and a command of 0."""
        if self._daq is None:
            self._daq = driver("nidaqmx", "rig")
            driver("nidaqmx.system.watchdog", "rig")
        if self.wiring.watchdog is not None:
            hint = " Not every device can watch analogue outputs: where it cannot, leave the watchdog out."
            with self._driver_errors(f"watchdog of {self.wiring.watchdog.device}", hint):
                self._watch(self.wiring.watchdog)
        for valve in self.wiring.valves:
            with self._driver_errors(valve.channel):
                task = self._kept(valve.channel, self._daq.Task())
                task.ao_channels.add_ao_voltage_chan(valve.channel, min_val=valve.low, max_val=valve.high)
                task.start()
                self._outputs.append((valve, task))
        self.write(0.0)
        laser = self.wiring.laser
        with self._driver_errors(laser.channel):
            task = self._kept(laser.channel, self._daq.Task())
            # the widest range of the card: else it would hide that the sensor is out of its own
            task.ai_channels.add_ai_voltage_chan(laser.channel, min_val=-10.0, max_val=10.0)
            task.start()
            self._input = task
        self.write(0.0)  # the watchdog may be short, and making tasks takes time

    def _watch(self, watchdog: Watchdog) -> None:
        make = self._daq.system.watchdog.WatchdogTask
        task = self._kept("watchdog of the card", make(watchdog.device, timeout=watchdog.timeout))
        kind = self._daq.constants.WatchdogAOExpirState.VOLTAGE
        state = self._daq.types.AOExpirationState
        rest = [state(valve.channel, valve.volts(0.0), kind) for valve in self.wiring.valves]
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

    def measure(self) -> float:
        """The displacement; NaN where the laser is out of its range."""
        laser = self.wiring.laser
        if self._input is None:
            raise RigError(f"{laser.channel}: read before it was opened.")
        with self._driver_errors(laser.channel):
            return laser.measured(float(self._input.read()))

    def write(self, command: float) -> None:
        """Volts to every valve, after which the watchdog waits anew."""
        if not self._outputs:
            raise RigError(f"{self.wiring.valves[0].channel}: written before it was opened.")
        every = [valve.volts(command) for valve, _ in self._outputs]  # of all, before one of them moves
        self.commanded = True
        try:
            for volts, (valve, task) in zip(every, self._outputs, strict=True):
                with self._driver_errors(valve.channel):
                    task.write(volts)
            if self._watchdog is not None:
                with self._driver_errors("watchdog of the card"):
                    self._watchdog.reset_timer()
        except RigError as error:
            self._explain_expired(error)
            raise

    def _explain_expired(self, error: RigError) -> None:
        """Raise an error that says so, if it was the watchdog that made a command fail."""
        watchdog = self.wiring.watchdog
        with suppress(self._daq.errors.Error, OSError):
            if watchdog and self._watchdog and self._watchdog.expired:
                raise RigError(
                    f"watchdog of {watchdog.device}: it has put the valves to a command of 0, since none came for "
                    f"{watchdog.timeout:g} s. Look at what holds up the loop."
                ) from error

    def vent(self) -> None:
        """A command of 0 to every valve, whatever becomes of the others."""
        zeros = [(valve.channel, partial(task.write, valve.volts(0.0))) for valve, task in self._outputs]
        first = [] if self._watchdog is None else [("watchdog of the card", self._unlock)]
        self._each([*first, *zeros])

    def close(self) -> None:
        """Clear all tasks; outputs keep their volts."""
        steps = [(what, task.close) for what, task in self._tasks]
        self._tasks, self._outputs, self._input, self._watchdog = [], [], None, None
        self._each(steps)

    def _each(self, steps: Iterable[tuple[str, Callable[[], Any]]]) -> None:
        """Take all steps; then raise the errors of those that failed."""
        wrong = []
        for what, step in steps:
            try:
                with self._driver_errors(what):
                    step()
            except RigError as error:
                wrong.append(error)
        if wrong:
            raise RigError(" ".join(str(error) for error in wrong)) from wrong[0]

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

"""A rig of any robot file: its quantities are commanded and its readings measured, in virtual or real time."""

import math
import time
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from nectosome.core import Status
from nectosome.description import RobotDescription, apply_settings, resolve
from nectosome.description.fields import Name, PositiveTime
from nectosome.io.file_system import exists
from nectosome.io.schema.described import Text
from nectosome.robots import describe
from nectosome.solve import SampledPlant
from nectosome.solve.sampled_plant import PlantState
from nectosome.units import InputError, read_quantity, shorten, split_unit, unit_to_si
from nectosome.units.ranges import split_range

from ..device_files import AnyQuantity, FileFields, Word, device_model, model_of_settings, same_unit, slope_per
from ..rig import FileZero, Rig, RigError

_SLACK = 1.0  # s by which a simulation may take longer than the time that it is of: a busy machine may pause it


@dataclass(frozen=True)
class ReadingSensor:
    """A sensor of a reading of a robot: text with units, or numbers in SI."""

    reading: Word
    """What it measures, as `nectosome control --measure` takes it: `heading`, `arm.angle`, `current.arm.angle`, ..."""
    noise: str | float = 0.0
    """Standard deviation, drawn anew at each measurement."""
    resolution: str | float = 0.0
    """Distance between the values that it can tell apart; 0 for all."""
    delay: str | float = 0.0
    """Time by which it is late."""
    range: str | None = None
    """LOW..HIGH, beyond which it has no reading (NaN)."""
    offset: str | float = 0.0
    """What it reads where the quantity is 0, as a load cell that has drifted; its range is of what it reads."""
    zero: str | float = 0.0
    """Reading where its measurement is 0, as `nectosome rig tare` finds it."""
    slope: Word | None = None
    """Measurement per count or volt, as `nectosome rig calibrate` finds it, for a sensor that gives such numbers.
    Noise, resolution, range, offset and zero are in counts or volts then."""
    true_slope: Word | None = None
    """Slope that the simulated sensor really has; as `slope` if left out."""


class _Sensor:
    """A sensor with its noise: raw = reading / true_slope + offset, and measurement = slope (raw - zero).

    Without slopes they are 1, and raw is in the SI unit of the reading.
    """

    def __init__(self, given: ReadingSensor, dimension: str, unit: str, field: str, seed: tuple[int, int]):
        self.slope = self._true_slope = 1.0
        self.raw_unit, self.sloped = unit, given.slope is not None
        if given.slope is not None:
            self.slope, self.raw_unit = _slope(given.slope, unit, f"{field}.slope")
            self._true_slope = self.slope
        if given.true_slope is not None:
            self._true_slope, raw_unit = _slope(given.true_slope, unit, f"{field}.true_slope")
            if not self.sloped:
                raise InputError("is missing: the slope that is assumed, as of a data sheet.", field=f"{field}.slope")
            if raw_unit != self.raw_unit:
                message = f"is per {raw_unit}, and slope is per {self.raw_unit}. Give both per {self.raw_unit}."
                raise InputError(message, field=f"{field}.true_slope")

        def raw(given: str | float, at: str) -> float:
            if not (self.sloped and isinstance(given, str)):
                return read_quantity(given, dimension, at)
            try:
                return same_unit(given, self.raw_unit)
            except ValueError as error:
                raise InputError(str(error), field=at) from None

        def not_negative(name: str, read: Callable[[str | float, str], float]) -> float:
            at = f"{field}.{name}"
            value = read(getattr(given, name), at)
            if value < 0:
                raise InputError(f'"{getattr(given, name)}" is out of range: it must be at least 0.', field=at)
            return value

        self.noise, self.resolution = not_negative("noise", raw), not_negative("resolution", raw)
        self.delay = not_negative("delay", lambda given, at: read_quantity(given, "time", at))
        self.offset, self.zero = raw(given.offset, f"{field}.offset"), raw(given.zero, f"{field}.zero")
        self._low, self._high = -math.inf, math.inf
        if given.range is not None:
            ends, at = split_range(given.range), f"{field}.range"
            if ends is None or ends.step or ends.log:
                raise InputError(
                    f'"{shorten(given.range)}" is no range. Write LOW..HIGH, as in "-90..90 deg".', field=at
                )
            self._low, self._high = (raw(end, at) for end in ends[:2])
            if not self._low < self._high:
                raise InputError(f'"{given.range}" is empty. Write the smaller end first.', field=at)
        self._draw = np.random.default_rng(seed)

    def measured(self, value: float) -> float:
        """The measurement of a value, which was delayed before: with noise, within its range, in its steps."""
        raw = (
            value / self._true_slope + self.offset + (self.noise * self._draw.standard_normal() if self.noise else 0.0)
        )
        if not self._low <= raw <= self._high:
            return math.nan
        if self.resolution:
            raw = self.resolution * round(raw / self.resolution)
        return self.slope * (raw - self.zero)


def _slope(text: str, unit: str, field: str) -> tuple[float, str]:
    """A slope in SI, and the SI unit that it is per. Raises InputError, which names the field."""
    expected = f'{unit or "A number"} per count or volt is expected, as in "47e-6 {unit}/count".'
    try:
        _, slash, below = split_unit(text)[1].rpartition("/")
        slope, si = slope_per(below if slash else "count", text, expected)
    except (InputError, ValueError) as error:
        message = error.message if isinstance(error, InputError) else f"{error} {expected}"
        raise InputError(message, field=field) from None
    if si != unit_to_si(unit)[1] or not 0 < abs(slope) < math.inf:
        raise InputError(f'"{shorten(text)}": {expected} It is finite and not 0.', field=field)
    return slope, unit_to_si(below)[1]


@dataclass(frozen=True)
class RobotSettings:
    """A simulated rig of a robot file; it starts with commands of 0, whatever the robot's file says."""

    robot: Word
    """Name of a robot that ships, or its file, relative to this one."""
    commands: Mapping[str, str]
    """Quantity of the robot, path or alias, that each command sets, in the unit of that quantity."""
    measurements: Mapping[str, ReadingSensor]
    """Sensor of each measurement."""
    set: Mapping[str, str] | None = None
    """Values of other quantities of it."""
    seed: Annotated[int, Field(ge=0, le=1_000_000)] = 0
    """Seed of the noise."""
    time_step: PositiveTime | None = None  # [s]
    """Time for which commands are held, and between readings; a share of dt. It is dt where left out."""
    real_time: bool = False
    """Whether a run takes as long as on a real rig."""


_NONE = AnyQuantity, "0"
_SENSOR = model_of_settings(ReadingSensor, noise=_NONE, resolution=_NONE, delay=_NONE, offset=_NONE, zero=_NONE)


class SimulatedRobot(Rig):
    """A robot that starts with commands of 0 when it is opened; they are held between steps of `dt`.

    - commands: a quantity of the robot, path or alias, by the name of each command. A command is the value of its
      quantity, in its SI unit. Whatever the robot's file says, that is 0 at first: a rig begins and ends so.
    - sensors: by the names of measurements.
    - pace: in virtual time the clock is that of the model and advances only in `wait`, as fast as the machine allows.
      In real time the model follows the clock of the machine; where it cannot keep up, samples come late, and beyond a
      second it is a RigError.
    - seed: of the noise. It goes on where the rig is opened again, so that repeated runs differ.

    What is not commanded goes on as the file says, at commands of 0 too. Raises InputError for an unknown quantity or
    reading, and for a quantity that cannot be 0.
    """

    described_by = device_model(
        "robot", RobotSettings,
        commands=dict[Name, Word], measurements=Annotated[dict[Name, _SENSOR], Field(min_length=1)],
        set=dict[str, Text] | None,
    )  # fmt: skip

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "SimulatedRobot":
        """That of `simulated_robot`."""
        sensors = {
            name: file.within("measurements", name).create(ReadingSensor, group)
            for name, group in given.measurements.items()
        }
        settings = file.create(RobotSettings, given, measurements=sensors)
        with file.errors():
            return simulated_robot(settings, file.folder, dt)

    def __init__(
        self,
        description: RobotDescription,
        commands: Mapping[str, str],
        sensors: Mapping[str, ReadingSensor],
        dt: float,
        *,
        pace: Literal["virtual", "real"] = "virtual",
        seed: int = 0,
        name: str | None = None,
    ):
        self.name, self.dt, self.pace = name or f"simulated {description.name}", dt, pace
        at_rest = _without_commands(description, commands)
        readings = [sensor.reading for sensor in sensors.values()]
        try:
            self._plant = SampledPlant(at_rest, [*commands.values()], readings, dt)
        except InputError as error:
            raise InputError(str(error), field="commands" if error.field else "measurements") from None
        self.commands = dict(zip(commands, (of.unit for of in self._plant.quantities), strict=True))
        self.measurements = dict(zip(sensors, (of.unit for of in self._plant.readings), strict=True))
        self._sensors = {
            name: _Sensor(one, of.dimension, of.unit, f"measurements.{name}", (seed, k))
            for k, ((name, one), of) in enumerate(zip(sensors.items(), self._plant.readings, strict=True))
        }
        self._loads = dict.fromkeys(sensors, 0.0)
        longest = max((sensor.delay for sensor in self._sensors.values()), default=0.0)
        kept = math.ceil(longest / dt) + 2
        self._seen = deque[np.ndarray](maxlen=kept)  # readings at the last steps
        self.commanded = self._opened = self._connected = False
        self._began = time.perf_counter()
        self._steps = 0  # since then

    def open(self) -> None:
        """Start the robot; all compilation happens here."""
        self.connect()
        self._opened = True

    def connect(self) -> None:
        """Start the robot, with commands of 0 for good."""
        self._held = (0.0,) * len(self.commands)
        self._state, _ = self._plant.start()
        self._after()  # compiles
        self._seen.clear()
        self._seen.append(self._state.readings)
        self._began = time.perf_counter() - self._steps * self.dt
        self._connected = True

    @property
    def true(self) -> tuple[float, ...]:
        """The present readings, without sensors."""
        self._needs(self._connected, "measured")
        self._go(self._step_now())
        return tuple(self._state.readings.tolist())

    def measure(self) -> tuple[float, ...]:
        """The present measurements."""
        self._needs(self._connected, "measured")
        self._go(self._step_now())
        sensors = enumerate(self._sensors.items())
        return tuple(
            sensor.measured(self._delayed(k, sensor.delay) + self._loads[name]) for k, (name, sensor) in sensors
        )

    def zero_of(self, name: str) -> FileZero:
        """That of its sensor."""
        sensor = self._sensors[name]
        return FileZero(("measurements", name), sensor.zero, sensor.slope, sensor.raw_unit, sensor.sloped)

    def put_on(self, name: str, load: float) -> bool:
        """The sensor measures it beside the robot's reading; the robot does not feel it."""
        self._loads[name] = load
        return True

    def write(self, commands: Sequence[float]) -> None:
        """Command the robot's quantities, until the next commands."""
        self._needs(self._opened, "written")
        for name, of, command in zip(self.commands, self._plant.quantities, commands, strict=True):
            try:
                of.read(float(command), units_required=False)
            except ValueError as error:
                raise RigError(f"{self.name}: {name}: {error}") from None
        self._go(self._step_now())
        self.commanded, self._held = True, tuple(map(float, commands))

    def vent(self) -> None:
        """All commands 0, at once."""
        self._held = (0.0,) * len(self.commands)

    def close(self) -> None:
        """Stop the simulation; its clock goes on."""
        self._opened = self._connected = False

    def now(self) -> float:
        """Time of the model, or of the machine."""
        return self._steps * self.dt if self.pace == "virtual" else time.perf_counter()

    def wait(self, until: float) -> None:
        """Simulate until then; in real time, wait for the rest of it."""
        if self.pace == "virtual":
            self._go(math.ceil(until / self.dt - 1e-6))
            return
        if self._connected:
            self._go(self._step_at(until))  # no command can come before: what is measured then is there in time
        super().wait(until)

    def _step_now(self) -> int:
        return self._steps if self.pace == "virtual" else self._step_at(time.perf_counter())

    def _step_at(self, when: float) -> int:
        return math.floor((when - self._began) / self.dt + 1e-6)

    def _go(self, until: int) -> None:
        """Simulate up to a step; a closed rig's clock goes on alone."""
        begun, first = time.perf_counter(), self._steps
        while self._steps < until and self._connected:
            self._state = self._after()
            self._seen.append(self._state.readings)
            self._steps += 1
        self._steps = max(self._steps, until)
        taken, simulated = time.perf_counter() - begun, (self._steps - first) * self.dt
        if self.pace == "real" and taken > simulated + _SLACK:
            raise RigError(
                f"{self.name}: the model cannot keep up with the clock: {simulated:.3g} s of it took {taken:.3g} s. "
                "Take virtual time, a longer time step, or a coarser robot."
            )

    def _after(self) -> PlantState:
        """The state after one more step."""
        state, _, status = self._plant.hold(self._state, *self._held)
        if status != Status.SOLVED:
            held = ", ".join(
                f"{name} {x:g} {unit}" for (name, unit), x in zip(self.commands.items(), self._held, strict=True)
            )
            at = self._state.sample * self.dt
            raise RigError(f"{self.name}: {at:.4g} s after its start, with {held}, the simulation {status.reason}.")
        return state

    def _delayed(self, k: int, delay: float) -> float:
        """A reading some time ago, on straight lines between steps; before the start it was as then."""
        if not delay:
            return float(self._seen[-1][k])
        values = [row[k] for row in self._seen]
        return float(np.interp(len(values) - 1 - delay / self.dt, np.arange(len(values)), values))

    def _needs(self, opened: bool, what: str) -> None:
        if not opened:
            raise RigError(f"{self.name}: {what} before it was opened.")


def _without_commands(description: RobotDescription, commands: Mapping[str, str]) -> RobotDescription:
    """The robot with 0 for all that is commanded."""
    for name, quantity in commands.items():
        try:
            resolve(description, quantity)
        except InputError as error:
            raise InputError(error.message, field=f"commands.{name}") from None
        try:
            description = apply_settings(description, {quantity: "0"})
        except InputError as error:
            why = f"{description.name} cannot begin with a {shorten(quantity)} of 0, and a rig begins and ends so"
            raise InputError(f"{why}: {error.message}", field=f"commands.{name}") from None
    return description


def simulated_robot(settings: RobotSettings, folder: Path, dt: float) -> SimulatedRobot:
    """The rig of these settings, from a file in `folder`, for samples dt [s] apart.

    Raises InputError, whose field is that of the settings.
    """
    step = dt if settings.time_step is None else settings.time_step
    if abs(dt / step - round(dt / step)) > 1e-6 or step > dt:
        raise InputError(
            f"{step:g} s, and dt is {dt:g} s: it has to fit into dt a whole number of times.", field="time_step"
        )
    file = folder / settings.robot
    try:
        description = describe(file if exists(file) else settings.robot)
    except InputError as error:
        raise InputError(str(error), field="robot") from None
    for name, value in (settings.set or {}).items():
        try:
            description = apply_settings(description, {name: value})
        except InputError as error:
            raise InputError(str(error), field=f"set.{name}") from None
    pace = "real" if settings.real_time else "virtual"
    channels = settings.commands, settings.measurements
    return SimulatedRobot(description, *channels, step, pace=pace, seed=settings.seed)

"""Dynamixel servos that hold angles, several on one bus, through ROBOTIS' dynamixel_sdk (protocol 2.0)."""

import math
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import partial
from typing import Annotated, Any, Literal

from pydantic import Field

from nectosome.description.fields import Angle, AngularSpeed, Name, PositiveTime
from nectosome.units import InputError, did_you_mean, show_span, show_value

from ..device_files import Baud, FileFields, Word, device_model, model_of_settings, outlasts
from ..rig import FileZero, Rig, RigError, driver, each, line, retried
from . import dynamixel_models as table
from .dynamixel_models import Model, Register, ServoReading

_ALERT, _OUT_OF_RANGE = 0x80, 4  # of the error field of an answer
_APPROACH = 0.5  # speed on the way to 0 [rad/s]
_NEAR = 0.05  # of 0, under a load [rad]


@dataclass(frozen=True)
class Servo:
    """A Dynamixel servo on a bus: which it is, and how its angles count."""

    number: Annotated[int, Field(ge=0, le=252)] = 1
    """ID of the servo on the bus."""
    zero: Angle = 0.0  # [rad]
    """Where an angle of 0 is, from the middle of its turn."""
    sign: Literal[1, -1] = 1
    """1, or -1 for a servo that is mounted the other way round."""
    speed: AngularSpeed = 5.0  # [rad/s]
    """Largest speed."""

    def __post_init__(self):
        if not 0 <= self.number <= 252:
            raise InputError(f"{self.number}; 0 to 252 are known.", field="number")
        if not -math.pi < self.zero < math.pi:
            raise InputError(
                f"{show_value(self.zero, 'rad')}; it lies within half a turn from the middle.", field="zero"
            )
        if self.sign not in (1, -1):
            raise InputError(f"{self.sign}; 1 or -1 expected.", field="sign")
        if not table.SPEED_UNIT <= self.speed <= 32_767 * table.SPEED_UNIT:
            raise InputError(f"{self.speed:g} rad/s; {table.SPEED_UNIT:.3f} to 786 rad/s are known.", field="speed")

    def step(self, angle: float) -> float:
        """The place in its turn for an angle [rad], in steps."""
        return table.MIDDLE + (self.zero + self.sign * angle) / table.STEP

    def angle(self, step: float) -> float:
        """The angle [rad] at a place in its turn."""
        return self.sign * ((step - table.MIDDLE) * table.STEP - self.zero)


@dataclass(frozen=True)
class Bus:
    """Dynamixel servos on one serial line."""

    port: Word
    """Serial port, as in /dev/ttyUSB0 or COM3."""
    servos: Mapping[str, Servo]
    """The servos, by their names."""
    baud: Baud = 57_600
    """Baud rate of the line."""
    watchdog: PositiveTime = 0.5  # [s]
    """Time without a packet after which the servos stop and hold their angles; several times dt."""
    record: Sequence[str] = ()
    """What is measured beside the angles: speed, current, voltage, temperature."""

    def __post_init__(self):
        if not self.servos:
            raise InputError("there are none.", field="servos")
        taken: dict[int, str] = {}
        for name, servo in self.servos.items():
            if servo.number in taken:
                message = f"{servo.number} is the number of {taken[servo.number]}."
                raise InputError(message, field=f"servos.{name}.number")
            taken[servo.number] = name
        if not table.WATCHDOG_UNIT <= self.watchdog <= 127 * table.WATCHDOG_UNIT:
            raise InputError(f"{self.watchdog:g} s; 0.02 to 2.54 s are known.", field="watchdog")
        for what in self.record:
            if what not in table.CHANNELS:
                hint = did_you_mean(what, table.CHANNELS) or f" Write some of {', '.join(table.CHANNELS)}."
                raise InputError(f'there is no "{what}" to record.{hint}', field="record")
        if len(set(self.record)) < len(self.record):
            raise InputError("each is recorded once.", field="record")


class Dynamixel(Rig):
    """Angles [rad] in, angles [rad] out, and what is recorded beside them, such as `left.current`.

    All servos are read with one packet, which they answer one after another, and get their angles with another one,
    which has no answer. `open` switches torque on where the servos stand and goes to 0 at 0.5 rad/s, then lets them
    move at their own speeds. Servos stop and hold their angles where no packet comes; only `vent` switches torque off.
    A lost answer is an error.
    """

    name = "Dynamixel"

    described_by = device_model(
        "dynamixel", Bus,
        servos=Annotated[dict[Name, model_of_settings(Servo)], Field(min_length=1)],
        record=tuple[Literal["speed", "current", "voltage", "temperature"], ...],
    )  # fmt: skip

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "Dynamixel":
        """Raises InputError for a watchdog that acts between two samples."""
        outlasts(file, given.watchdog, dt, "watchdog")
        servos = {name: file.within("servos", name).create(Servo, group) for name, group in given.servos.items()}
        return cls(file.create(Bus, given, servos=servos))

    def __init__(self, bus: Bus):
        self.bus = bus
        self.commands = dict.fromkeys(bus.servos, "rad")
        self.measurements = {
            channel: unit
            for name in bus.servos
            for channel, unit in [(name, "rad"), *((f"{name}.{what}", table.CHANNELS[what].si) for what in bus.record)]
        }
        registers = [table.POSITION, *(table.CHANNELS[what].register for what in bus.record)]
        self._start = min(register.address for register in registers)
        self._length = max(register.address + register.size for register in registers) - self._start
        self._models: dict[str, Model] = {}
        self._ranges: dict[str, tuple[int, int]] = {}  # of steps; only where the servos are driven
        self._port: Any = None
        self._protocol: Any = None
        self._asked, self._paused = -math.inf, False
        self.commanded = False

    def connect(self) -> None:
        """Find the servos and check what they are."""
        sdk = driver("dynamixel_sdk", "rig")
        self._protocol = sdk.Protocol2PacketHandler()
        with line(self.bus.port):
            port = sdk.PortHandler(self.bus.port)
            if not port.setBaudRate(self.bus.baud):
                raise RigError(f"{self.bus.port}: dynamixel_sdk knows no baud rate of {self.bus.baud}.")
        self._port = port
        for name, servo in self.bus.servos.items():
            with self._exchange():
                number, result, error = self._protocol.ping(port, servo.number)
            self._check(name, result, error)
            self._models[name] = self._known(name, number)

    def _known(self, name: str, number: int) -> Model:
        """The model of a number."""
        if number not in table.MODELS:
            what = table.family(number) or "not known"
            raise RigError(
                f"{self._where(name)}: model {number} is {what}. Look at the servo's ID: one of the X series, or an MX "
                "with protocol 2.0, is expected."
            )
        model = table.MODELS[number]
        if "current" in self.bus.record and model.current is None:
            raise RigError(f"{self._where(name)}: {model.name} measures no current. Take it out of what is recorded.")
        return model

    def open(self) -> None:
        """Find the servos, check all of them, and go slowly to 0."""
        self.connect()
        ranges = {name: self._prepare(name) for name in self.bus.servos}
        for name in self.bus.servos:
            self._set(name, table.PROFILE_VELOCITY, round(_APPROACH / table.SPEED_UNIT))
            self._set(name, table.GOAL, self._get(name, table.POSITION))
            self._set(name, table.TORQUE, 1)
        self._watch()
        self._ranges = ranges
        self._approach()
        for name, servo in self.bus.servos.items():
            self._set(name, table.PROFILE_VELOCITY, int(servo.speed / table.SPEED_UNIT))

    def _prepare(self, name: str) -> tuple[int, int]:
        """Position mode, without torque: where this is on its settings are locked. The range of its steps."""
        faults = self._get(name, table.HARDWARE_ERROR)
        if faults:
            raise RigError(self._fault_text(name, faults))
        self._set(name, table.TORQUE, 0)
        self._set(name, table.WATCHDOG, 0)  # forget that it stopped in an earlier run
        mode = self._get(name, table.DRIVE_MODE)
        for bit, what in table.ODD_DRIVE_MODES.items():
            if mode & bit:
                raise RigError(
                    f"{self._where(name)}: its Drive Mode ({mode}) is one that {what}. "
                    f"Take {bit} from it with the DYNAMIXEL Wizard."
                )
        if self._get(name, table.OPERATING_MODE) != table.POSITION_MODE:  # kept in a memory that wears out
            self._set(name, table.OPERATING_MODE, table.POSITION_MODE)
        least, most = self._get(name, table.LEAST_STEP), self._get(name, table.MOST_STEP)
        self._step(name, 0.0, (least, most))
        return least, most

    def _watch(self) -> None:
        """Set the watchdogs of all servos at once: one that waits for the others could act meanwhile."""
        units = math.ceil(self.bus.watchdog / table.WATCHDOG_UNIT - 1e-9)
        self._set_all(table.WATCHDOG, dict.fromkeys(self.bus.servos, units))
        for name, data in self._get_all(table.WATCHDOG.address, table.WATCHDOG.size).items():
            if (told := table.WATCHDOG.value(data)) != units:
                raise RigError(f"{self._where(name)}: its watchdog is {told}, and {units} was set. Look at the cable.")
        self._paused = False

    def _approach(self) -> None:
        """To 0; each read resets the watchdogs."""
        far = max(abs(angle) for angle in self._angles().values())
        limit = time.perf_counter() + far / _APPROACH + 1.0
        self.write([0.0] * len(self.bus.servos))
        while off := {name: angle for name, angle in self._angles().items() if abs(angle) > _NEAR}:
            if time.perf_counter() > limit:
                name, angle = next(iter(off.items()))
                at = show_value(angle, "rad", digits=3)
                raise RigError(f"{self._where(name)}: went to 0 and stays at {at}. Look at what blocks or loads it.")
            time.sleep(0.005)

    def measure(self) -> tuple[float, ...]:
        """Angles, and what is recorded, in the order of `measurements`."""
        values = []
        for name, data in self._get_all(self._start, self._length).items():
            servo = self.bus.servos[name]
            values.append(servo.angle(self._cut(data, table.POSITION)))
            for what in self.bus.record:
                channel = table.CHANNELS[what]
                value = self._cut(data, channel.register) * self._unit(name, what, channel) + channel.shift
                values.append(servo.sign * value if channel.signed else value)
        return tuple(values)

    def _angles(self) -> dict[str, float]:
        told = dict(zip(self.measurements, self.measure(), strict=True))
        return {name: told[name] for name in self.bus.servos}

    def _cut(self, data: bytes, register: Register) -> int:
        """The value of a register in the bytes that all servos are asked for."""
        start = register.address - self._start
        return register.value(data[start : start + register.size])

    def _unit(self, name: str, what: str, channel: ServoReading) -> float:
        return self._models[name].current or math.nan if what == "current" else channel.unit

    def write(self, commands: Sequence[float]) -> None:
        """The angles to go to, each to the nearest of 4096 steps a turn; none moves if one is not allowed."""
        if not self._ranges:
            raise RigError(f"{self.bus.port}: written before it was opened.")
        angles = dict(zip(self.bus.servos, commands, strict=True))
        steps = {name: self._step(name, angle, self._ranges[name]) for name, angle in angles.items()}
        if self._paused or time.monotonic() - self._asked > self.bus.watchdog / 2:
            self._check_watchdogs()
        self._set_all(table.GOAL, steps)

    def check_command(self, name: str, command: float) -> None:
        """Raise RigError for an angle beyond the servo's turn, or its own range where this is known."""
        self._step(name, command, self._ranges.get(name, (0, table.STEPS - 1)))

    def _step(self, name: str, angle: float, within: tuple[int, int]) -> int:
        """The step of an angle; a packet for all servos has no answer that could refuse it."""
        servo = self.bus.servos[name]
        least, most = within
        step = servo.step(angle)
        if not least - 0.5 < step < most + 0.5:  # nor where it is NaN
            least, most = sorted(servo.angle(end) for end in within)
            ends = show_span(least, most, "rad", digits=4)
            raise RigError(
                f"{self._where(name)}: a command of {show_value(angle, 'rad')} is beyond its range of "
                f"{ends}. Keep within it, or look at its limits with the DYNAMIXEL Wizard."
            )
        return round(step)

    def _check_watchdogs(self) -> None:
        """Whether a servo has stopped since no packet came; it says nothing by itself to a packet for all."""
        for name, data in self._get_all(table.WATCHDOG.address, table.WATCHDOG.size).items():
            if table.WATCHDOG.value(data) == table.EXPIRED:
                raise RigError(self._stopped(name))
        self._paused = False

    def zero_of(self, name: str) -> FileZero | None:
        """That of the angle of a servo."""
        servo = self.bus.servos.get(name)
        return servo and FileZero(("servos", name), servo.zero, float(servo.sign), "rad")

    def vent(self) -> None:
        """Torque off: of all at once, then of each, tried three times, whatever becomes of the others."""
        if self._port is None:
            return
        with suppress(RigError):
            self._set_all(table.TORQUE, dict.fromkeys(self.bus.servos, 0))
        steps = [partial(self._set, name, table.TORQUE, 0, alerted=True) for name in self.bus.servos]
        each(partial(retried, off, "Its torque may still be on: switch off its power.") for off in steps)

    def close(self) -> None:
        """Release the port."""
        port, self._port = self._port, None
        self._ranges = {}
        if port is not None:
            with line(self.bus.port):
                port.closePort()

    def _get(self, name: str, register: Register, alerted: bool = False) -> int:
        """Value of a register; `alerted`: even while the servo reports a hardware error."""
        number = self.bus.servos[name].number
        with self._exchange():
            data, result, error = self._protocol.readTxRx(self._port, number, register.address, register.size)
        self._check(name, result, error & ~_ALERT if alerted else error)
        return register.value(self._whole(name, data, register.size))

    def _set(self, name: str, register: Register, value: int, alerted: bool = False) -> None:
        number, data = self.bus.servos[name].number, list(register.bytes(value))
        self.commanded = True
        with self._exchange():
            result, error = self._protocol.writeTxRx(self._port, number, register.address, register.size, data)
        self._check(name, result, error & ~_ALERT if alerted else error)

    def _get_all(self, address: int, size: int) -> dict[str, bytes]:
        """Bytes of all servos, by one packet: as GroupSyncRead of the SDK, which drops errors, and whose they are."""
        numbers = [servo.number for servo in self.bus.servos.values()]
        answers: dict[str, tuple[Sequence[int], int, int]] = {}  # data, result, error
        with self._exchange():
            result = self._protocol.syncReadTx(self._port, address, size, numbers, len(numbers), False)
            for name, number in zip(self.bus.servos, numbers, strict=True):
                answers[name] = ([], result, 0) if result else self._protocol.readRx(self._port, number, size)
                if answers[name][1]:
                    break  # the SDK has dropped answers that came while it waited for this one
        for name, (_, result, error) in answers.items():
            self._check(name, result, error)
        return {name: self._whole(name, data, size) for name, (data, _, _) in answers.items()}

    def _set_all(self, register: Register, values: Mapping[str, int]) -> None:
        """Write a register of all servos, by one packet without an answer, as GroupSyncWrite of the SDK."""
        parameters = [
            byte for name, value in values.items() for byte in (self.bus.servos[name].number, *register.bytes(value))
        ]
        self.commanded = True
        with self._exchange():
            result = self._protocol.syncWriteTxOnly(
                self._port, register.address, register.size, parameters, len(parameters)
            )
        if result:
            self._check(next(iter(values)), result, 0)

    def _whole(self, name: str, data: Sequence[int], size: int) -> bytes:
        if len(data) != size:
            raise RigError(f"{self._where(name)}: an answer of {len(data)} bytes where {size} were asked for.")
        return bytes(data)

    @contextmanager
    def _exchange(self) -> Iterator[None]:
        if self._port is None:
            raise RigError(f"{self.bus.port}: used before it was opened.")
        now = time.monotonic()
        self._paused |= now - self._asked > self.bus.watchdog / 2
        self._asked = now
        try:
            with line(self.bus.port):
                yield
        finally:
            self._port.is_using = False  # the SDK forgets this where the line breaks

    def _check(self, name: str, result: int, error: int) -> None:
        """Raise RigError for a packet's result or the error field of its answer."""
        where = self._where(name)
        if result:
            said = self._protocol.getTxRxResult(result).removeprefix("[TxRxResult] ").rstrip("!")
            raise RigError(
                f"{where}: {said}. Look at its power, the cable, its ID, and its baud rate ({self.bus.baud} expected)."
            )
        if error & _ALERT:
            raise RigError(self._fault_text(name, self._get(name, table.HARDWARE_ERROR, alerted=True)))
        if error == _OUT_OF_RANGE and self._get(name, table.WATCHDOG) == table.EXPIRED:
            raise RigError(self._stopped(name))
        if error:
            said = self._protocol.getRxPacketError(error).removeprefix("[RxPacketError] ").rstrip("!")
            raise RigError(f"{where}: {said}. Look at its limits with the DYNAMIXEL Wizard.")

    def _where(self, name: str) -> str:
        return f"servo {name} ({self.bus.servos[name].number}) at {self.bus.port}"

    def _stopped(self, name: str) -> str:
        return (
            f"{self._where(name)}: it has stopped, since no packet came for {self.bus.watchdog:g} s. "
            "Look at what holds up the loop."
        )

    def _fault_text(self, name: str, bits: int) -> str:
        words = ", ".join(word for bit, word in table.FAULTS.items() if bits & bit) or f"bits {bits:#04x}"
        return f"{self._where(name)}: hardware error: {words}. Remove the cause, then switch its power off and on."

"""A Dynamixel XW540 servo, which holds angles, through ROBOTIS' dynamixel_sdk."""

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from typing import Any

from nectosome.units import InputError

from .rig import Rig, RigError, driver, line, retried

# Control table of the XW540, and its units: ROBOTIS e-Manual, pages XW540-T140 and XW540-T260 (firmware 38 on).
_MODELS = {1170: "XW540-T260", 1180: "XW540-T140"}
_DRIVE_MODE, _OPERATING_MODE = (10, 1), (11, 1)  # (address, bytes)
_TORQUE, _HARDWARE_ERROR, _WATCHDOG = (64, 1), (70, 1), (98, 1)
_PROFILE_VELOCITY, _GOAL, _PRESENT = (112, 4), (116, 4), (132, 4)
_POSITION_MODE = 3
_ODD_DRIVE_MODES = {0x04: "times its motions instead of limiting their speed", 0x08: "takes torque on by itself"}
_FAULTS = {0x01: "input voltage", 0x04: "overheating", 0x08: "encoder", 0x10: "electrical shock", 0x20: "overload"}
_ALERT, _OUT_OF_RANGE = 0x80, 4  # of the error field of an answer
_STEPS, _MIDDLE = 4096, 2048  # a turn; an angle of 0
_SPEED_UNIT = 0.229 * 2 * math.pi / 60  # [rad/s]
_WATCHDOG_UNIT = 0.02  # [s]
_APPROACH = 0.5  # speed on the way to 0 [rad/s]
_NEAR = 0.05  # of 0, under a load [rad]


@dataclass(frozen=True)
class Servo:
    """A Dynamixel servo: where it is and what it may do."""

    port: str
    """Serial port, as in /dev/ttyUSB0 or COM3."""
    number: int = 1
    """ID of the servo on the line."""
    baud: int = 57_600
    """Baud rate of the line."""
    speed: float = 5.0  # [rad/s]
    """Largest speed."""
    watchdog: float = 0.5  # [s]
    """Time without a packet after which the servo stops and holds its angle; several times dt."""

    def __post_init__(self):
        if not _SPEED_UNIT <= self.speed <= 32_767 * _SPEED_UNIT:
            raise InputError(f"{self.speed:g} rad/s; {_SPEED_UNIT:.3f} to 786 rad/s are known.", field="speed")
        if not _WATCHDOG_UNIT <= self.watchdog <= 127 * _WATCHDOG_UNIT:
            raise InputError(f"{self.watchdog:g} s; 0.02 to 2.54 s are known.", field="watchdog")


class Dynamixel(Rig):
    """Angle [rad] in, angle [rad] out; 0 is the middle of its turn.

    `open` switches torque on where the servo stands and goes to 0 at 0.5 rad/s, then lets it move at its own speed. The
    servo stops and holds its angle where no packet comes; only `vent` switches torque off. A lost answer is an error.
    """

    name = "Dynamixel"
    command_unit = "rad"
    measured_unit = "rad"

    def __init__(self, servo: Servo):
        self.servo = servo
        self._where = f"servo {servo.number} at {servo.port}"
        self._port: Any = None
        self._protocol: Any = None
        self.commanded = False

    def open(self) -> None:
        """Find the servo, check it, and go slowly to 0."""
        sdk = driver("dynamixel_sdk", "rig")
        self._protocol = sdk.Protocol2PacketHandler()
        with line(self._where):
            port = sdk.PortHandler(self.servo.port)
            if not port.setBaudRate(self.servo.baud):
                raise RigError(f"{self._where}: dynamixel_sdk knows no baud rate of {self.servo.baud}.")
        self._port = port
        with self._exchange():
            model, result, error = self._protocol.ping(port, self.servo.number)
        self._check(result, error)
        if model not in _MODELS:
            known = " or ".join(f"{name} ({number})" for number, name in _MODELS.items())
            raise RigError(f"{self._where}: model {model}, but {known} expected. Look at the servo's ID.")
        self._prepare()
        self._set(_PROFILE_VELOCITY, round(_APPROACH / _SPEED_UNIT))
        self._set(_GOAL, self._get(_PRESENT))
        self._set(_TORQUE, 1)
        self._set(_WATCHDOG, math.ceil(self.servo.watchdog / _WATCHDOG_UNIT - 1e-9))
        self._approach()
        self._set(_PROFILE_VELOCITY, int(self.servo.speed / _SPEED_UNIT))

    def _prepare(self) -> None:
        """Position mode, without torque: where this is on its settings are locked."""
        faults = self._get(_HARDWARE_ERROR)
        if faults:
            raise RigError(self._fault_text(faults))
        self._set(_TORQUE, 0)
        self._set(_WATCHDOG, 0)  # forget that it stopped in an earlier run
        mode = self._get(_DRIVE_MODE)
        for bit, what in _ODD_DRIVE_MODES.items():
            if mode & bit:
                raise RigError(
                    f"{self._where}: its Drive Mode ({mode}) is one that {what}. "
                    f"Take {bit} from it with the DYNAMIXEL Wizard."
                )
        if self._get(_OPERATING_MODE) != _POSITION_MODE:  # kept in a memory that wears out
            self._set(_OPERATING_MODE, _POSITION_MODE)

    def _approach(self) -> None:
        """To 0; each read resets the watchdog."""
        limit = time.perf_counter() + abs(self.measure()) / _APPROACH + 1.0
        self.write(0.0)
        while abs(angle := self.measure()) > _NEAR:
            if time.perf_counter() > limit:
                raise RigError(
                    f"{self._where}: went to 0 and stays at {angle:.2f} rad. Look at what blocks or loads it."
                )
            time.sleep(0.005)

    def measure(self) -> float:
        """The angle."""
        return (self._get(_PRESENT) - _MIDDLE) * (2 * math.pi / _STEPS)

    def write(self, command: float) -> None:
        """The angle to go to, to the nearest of 4096 steps a turn."""
        self._set(_GOAL, self.step(command))

    def step(self, command: float) -> int:
        """The step of an angle."""
        step = _MIDDLE + command * (_STEPS / (2 * math.pi))
        if not -0.5 < step < _STEPS - 0.5:  # nor where it is NaN
            raise RigError(f"{self._where}: a command of {command:g} rad is beyond half a turn from 0.")
        return round(step)

    def vent(self) -> None:
        """Torque off, tried three times."""
        if self._port is not None:
            off = partial(self._set, _TORQUE, 0, alerted=True)
            retried(off, "Its torque may still be on: switch off its power.")

    def close(self) -> None:
        """Release the port."""
        port, self._port = self._port, None
        if port is not None:
            with line(self._where):
                port.closePort()

    def _get(self, register: tuple[int, int], alerted: bool = False) -> int:
        """Value of a register; `alerted`: even while the servo reports a hardware error."""
        address, size = register
        with self._exchange():
            data, result, error = self._protocol.readTxRx(self._port, self.servo.number, address, size)
        self._check(result, error & ~_ALERT if alerted else error)
        if len(data) != size:
            raise RigError(f"{self._where}: an answer of {len(data)} bytes where {size} were asked for.")
        return int.from_bytes(bytes(data), "little", signed=size == 4)

    def _set(self, register: tuple[int, int], value: int, alerted: bool = False) -> None:
        address, size = register
        data = list(value.to_bytes(size, "little", signed=size == 4))
        self.commanded = True
        with self._exchange():
            result, error = self._protocol.writeTxRx(self._port, self.servo.number, address, size, data)
        self._check(result, error & ~_ALERT if alerted else error)

    @contextmanager
    def _exchange(self) -> Iterator[None]:
        if self._port is None:
            raise RigError(f"{self._where}: used before it was opened.")
        try:
            with line(self._where):
                yield
        finally:
            self._port.is_using = False  # the SDK forgets this where the line breaks

    def _check(self, result: int, error: int) -> None:
        """Raise RigError for a packet's result or the error field of its answer."""
        if result:
            said = self._protocol.getTxRxResult(result).removeprefix("[TxRxResult] ").rstrip("!")
            raise RigError(
                f"{self._where}: {said}. Look at its power, the cable, its ID, and its baud rate"
                f" ({self.servo.baud} expected)."
            )
        if error & _ALERT:
            raise RigError(self._fault_text(self._get(_HARDWARE_ERROR, alerted=True)))
        if error == _OUT_OF_RANGE and self._get(_WATCHDOG) == 0xFF:
            raise RigError(
                f"{self._where}: it has stopped, since no packet came for {self.servo.watchdog:g} s. "
                "Look at what holds up the loop."
            )
        if error:
            said = self._protocol.getRxPacketError(error).removeprefix("[RxPacketError] ").rstrip("!")
            raise RigError(f"{self._where}: {said}. Look at its limits with the DYNAMIXEL Wizard.")

    def _fault_text(self, bits: int) -> str:
        words = ", ".join(name for bit, name in _FAULTS.items() if bits & bit) or f"bits {bits:#04x}"
        return f"{self._where}: hardware error: {words}. Remove the cause, then switch its power off and on."

"""Inertial measurement units: an MPU6050 on an I2C bus of this machine, or any behind a microcontroller.

Accelerations are what the sensor feels, gravity and all: at rest 9.81 m/s2 upwards. Its axes are printed on its board.
"""

import errno
import math
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Annotated, Literal, Protocol

from pydantic import Field

from nectosome.description.fields import PositiveAngularSpeed, PositiveFrequency
from nectosome.io.schema.quantity import Quantity
from nectosome.units import InputError

from ..device_files import device_model
from ..rig import RigError, SensorRig, one_line
from .serial_line import SerialLine, SerialLink

MEASUREMENTS: Mapping[str, str] = {
    "ax": "m/s2", "ay": "m/s2", "az": "m/s2", "wx": "rad/s", "wy": "rad/s", "wz": "rad/s", "temperature": "K"
}  # fmt: skip

# InvenSense, MPU-6000 and MPU-6050 Register Map and Descriptions, revision 4.2
_FILTER, _RATES, _ACCELERATIONS, _DATA, _POWER, _WHO = 0x1A, 0x1B, 0x1C, 0x3B, 0x6B, 0x75
_NAME = 0x68  # in WHO_AM_I, whatever the address
_SLEEP, _CLOCK_OF_GYROSCOPE = 0x40, 0x01  # of the power register
_DATA_LENGTH = 14  # accelerations, temperature, rates: 16 bits each, the higher byte first
_GRAVITY = 9.80665  # [m/s2]
_PER_GRAVITY = {2: 16384.0, 4: 8192.0, 8: 4096.0, 16: 2048.0}  # numbers per 9.80665 m/s2, by range
_PER_DEGREE = {250: 131.0, 500: 65.5, 1000: 32.8, 2000: 16.4}  # numbers per deg/s, by range
_BANDWIDTHS = (260.0, 184.0, 94.0, 44.0, 21.0, 10.0, 5.0)  # of accelerations [Hz]; those of rates are 2 to 4 Hz beside
_ENDS = (-(2**15), 2**15 - 1)  # numbers beyond which it sees nothing


@dataclass(frozen=True)
class MPU6050:
    """An MPU6050 on an I2C bus: where it is, and what it has to measure."""

    bus: Annotated[int, Field(ge=0, le=1000)] = 1
    """Number of the bus, as of /dev/i2c-1."""
    address: Literal[0x68, 0x69] = _NAME
    """Address on the bus: 104 (0x68), or 105 where its pin AD0 is high."""
    acceleration: Annotated[float, Quantity("acceleration")] = 2 * _GRAVITY  # [m/s2]
    """Largest acceleration, with gravity; of the ranges of 2, 4, 8 and 16 g the first one with it is taken."""
    rate: PositiveAngularSpeed = math.radians(250)  # [rad/s]
    """Largest angular speed; of the ranges of 250, 500, 1000 and 2000 deg/s the first one with it is taken."""
    bandwidth: PositiveFrequency = 44.0  # [Hz]
    """Largest bandwidth of its filter, under half the sampling rate: of 260, 184, 94, 44, 21, 10 and 5 Hz the first one
    that is not above it is taken."""

    def __post_init__(self):
        if self.address not in (0x68, 0x69):
            raise InputError(f"{self.address}; 104 or 105 are known.", field="address")
        if not 0 < self.acceleration <= 16 * _GRAVITY:
            raise InputError(f"{self.acceleration:g} m/s2; up to 156.9 m/s2 (16 g) are known.", field="acceleration")
        if not 0 < self.rate <= math.radians(2000):
            raise InputError(f"{math.degrees(self.rate):g} deg/s; up to 2000 deg/s are known.", field="rate")
        if not self.bandwidth >= _BANDWIDTHS[-1]:
            raise InputError(f"{self.bandwidth:g} Hz; 5 Hz or more are known.", field="bandwidth")

    @property
    def ranges(self) -> tuple[int, int, int]:
        """Its settings for accelerations, rates and filter, as they stand in its registers."""
        acceleration = next(k for k, g in enumerate(_PER_GRAVITY) if self.acceleration <= g * _GRAVITY)
        rate = next(k for k, degrees in enumerate(_PER_DEGREE) if self.rate <= math.radians(degrees))
        return acceleration, rate, next(k for k, band in enumerate(_BANDWIDTHS) if band <= self.bandwidth)


class Registers(Protocol):
    """A device with registers on a bus. All methods raise OSError where it does not acknowledge."""

    def read(self, register: int, length: int = 1) -> bytes:
        """Bytes from a register on."""
        ...

    def write(self, register: int, value: int) -> None:
        """Set a register."""
        ...

    def close(self) -> None:
        """Release the bus."""
        ...


class I2C:
    """A device on an I2C bus of Linux, by the kernel's own interface (its documentation, i2c/dev-interface)."""

    _SLAVE = 0x0703  # request of linux/i2c-dev.h: talk to this address from now on

    def __init__(self, bus: int, address: int):
        try:
            from fcntl import ioctl
        except ImportError:
            raise OSError(errno.ENODEV, "I2C needs Linux") from None
        self._file = os.open(f"/dev/i2c-{bus}", os.O_RDWR)
        try:
            ioctl(self._file, self._SLAVE, address)
        except OSError:
            self.close()
            raise

    def read(self, register: int, length: int = 1) -> bytes:
        """Bytes from a register on."""
        os.write(self._file, bytes([register]))
        data = os.read(self._file, length)
        if len(data) != length:
            raise OSError(errno.EIO, f"{len(data)} bytes instead of {length}")
        return data

    def write(self, register: int, value: int) -> None:
        """Set a register."""
        os.write(self._file, bytes([register, value]))

    def close(self) -> None:
        """Release the bus."""
        os.close(self._file)


class IMU(SensorRig):
    """Accelerations, angular speeds and the temperature of an MPU6050, read at once.

    `connection` opens a device by the number of its bus and its address.
    """

    name = "IMU"
    measurements = MEASUREMENTS
    described_by = device_model("imu", MPU6050)

    def __init__(self, sensor: MPU6050, connection: Callable[[int, int], Registers] = I2C):
        self.sensor = sensor
        self._connection = connection
        self._device: Registers | None = None
        self._where = f"IMU on I2C bus {sensor.bus}, address {sensor.address:#04x}"
        acceleration, rate, _ = sensor.ranges
        self._units = (
            _GRAVITY / list(_PER_GRAVITY.values())[acceleration],
            math.radians(1.0) / list(_PER_DEGREE.values())[rate],
        )

    def connect(self) -> None:
        """Find the sensor, wake it, and set its ranges and its filter."""
        acceleration, rate, band = self.sensor.ranges
        settings = {_POWER: _CLOCK_OF_GYROSCOPE, _FILTER: band, _RATES: rate << 3, _ACCELERATIONS: acceleration << 3}
        with self._errors():
            self._device = device = self._connection(self.sensor.bus, self.sensor.address)
            (told,) = device.read(_WHO)
            if told != _NAME:
                names = f"it calls itself {told:#04x}, and an MPU6050 {_NAME:#04x}"
                raise RigError(f"{self._where}: {names}. Look at its address.")
            for register, value in settings.items():
                device.write(register, value)
                (kept,) = device.read(register)
                if kept != value:
                    values = f"keeps {kept:#04x}, and {value:#04x} was set"
                    raise RigError(
                        f"{self._where}: its register {register:#04x} {values}. Look at its wires and its supply."
                    )

    def measure(self) -> tuple[float, ...]:
        """What it measures, in the order of `measurements`; NaN where an axis is at an end of its range."""
        if self._device is None:
            raise RigError(f"{self._where}: read before it was opened.")
        with self._errors():
            data = self._device.read(_DATA, _DATA_LENGTH)
            if not any(data) and self._device.read(_POWER)[0] & _SLEEP:
                raise RigError(f"{self._where}: it has been reset, and sleeps. Look at its supply.")
        numbers = [int.from_bytes(data[k : k + 2], "big", signed=True) for k in range(0, _DATA_LENGTH, 2)]
        per_acceleration, per_rate = self._units
        scaled = [(n, per_acceleration) for n in numbers[:3]] + [(n, per_rate) for n in numbers[4:]]
        values = (math.nan if n in _ENDS else n * unit for n, unit in scaled)
        return (*values, numbers[3] / 340.0 + 36.53 + 273.15)

    def close(self) -> None:
        """Release the bus; the sensor keeps measuring."""
        device, self._device = self._device, None
        if device is not None:
            with self._errors():
                device.close()

    @contextmanager
    def _errors(self) -> Iterator[None]:
        """Errors of the bus become RigError."""
        try:
            yield
        except OSError as error:
            hint = "Look at its wires, its power and its address, and whether I2C is switched on."
            if error.errno in (errno.EACCES, errno.EPERM):
                hint = (
                    "This user may not use the bus: its group, mostly i2c, must have the user as a member. Look there."
                )
            raise RigError(f"{self._where}: the bus does not work ({one_line(error)}). {hint}") from error


class SerialIMU(SensorRig):
    """Accelerations, angular speeds and the temperature that a microcontroller measures, by the serial protocol.

    - sample: that of the last reading, by the controller's count since its reset
    """

    name = "IMU"
    measurements = MEASUREMENTS
    described_by = device_model("serial_imu", SerialLink)

    def __init__(self, link: SerialLink):
        self.link = link
        self.line = SerialLine(link, "IMU")
        self.sample = 0

    def connect(self) -> None:
        """Wait until the controller runs."""
        self.line.open()

    def measure(self) -> tuple[float, ...]:
        """What it measures, in the order of `measurements`; NaN where it does not know."""
        words = self.line.ask("I", "I")
        try:
            sample, *values = words
            self.sample, told = int(sample), tuple(map(float, values))
        except ValueError:
            told = ()
        if len(told) != len(self.measurements):
            said = " ".join(words)
            raise RigError(f"{self.line.where}: {said!r} is no answer. Look at the program of the controller.")
        return told

    def close(self) -> None:
        """Release the port."""
        self.line.close()

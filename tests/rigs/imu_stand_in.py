"""What stands in for an MPU6050 on a bus, by its register map, and a microcontroller that has one."""

import errno

from .motor_emulator import Microcontroller, OverRadio

WHO, POWER, FILTER, RATES, ACCELERATIONS, DATA = 0x75, 0x6B, 0x1A, 0x1B, 0x1C, 0x3B
REST = bytes.fromhex("0000 0000 4000 EEF0 0000 0000 0000")
"""A level sensor: 0, 0, 16384 (1 g of 2), -4368 (23.683 °C), and no rates."""


class Chip:
    """An MPU6050 at an address of a bus, and the call that connects to it. `absent`: nothing acknowledges."""

    def __init__(self, bus: int = 1, address: int = 0x68, data: bytes = REST):
        self.bus, self.address, self.data, self.absent, self.open = bus, address, data, False, 0
        self.written: list[tuple[int, int]] = []
        self.reset()

    def reset(self):
        """As by its supply: it sleeps, and its ranges are the smallest."""
        self.registers = {WHO: 0x68, POWER: 0x40, FILTER: 0, RATES: 0, ACCELERATIONS: 0}

    def __call__(self, bus: int, address: int) -> "Chip":
        if bus != self.bus:
            raise FileNotFoundError(errno.ENOENT, "No such file or directory", f"/dev/i2c-{bus}")
        self.absent |= address != self.address
        self.open += 1
        return self

    def _acknowledge(self):
        if self.absent:
            raise OSError(errno.EREMOTEIO, "Remote I/O error")

    def read(self, register: int, length: int = 1) -> bytes:
        self._acknowledge()
        if register == DATA:
            return bytes(length) if self.registers[POWER] & 0x40 else self.data[:length]
        return bytes([self.registers[register]])

    def write(self, register: int, value: int):
        self._acknowledge()
        self.written.append((register, value))
        self.registers[register] = value

    def close(self):
        self.open -= 1


class Measuring(Microcontroller):
    """A microcontroller with an IMU."""

    values = "0.0000 0.0000 9.8067 0.0000 0.0000 0.5000 296.8329"

    def _told(self, question: str) -> str:
        told = super()._told(question)
        return f"I {self.samples} {self.values}" if question == "I" else told


class MeasuringOverRadio(Measuring, OverRadio):
    """The same behind a radio link."""

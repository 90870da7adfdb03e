"""Dynamixel servos on a bus that speak protocol 2.0, written from ROBOTIS' e-Manual and not from its SDK."""

import math
import time

from .on_a_pty import OnAPty

HEADER = b"\xff\xff\xfd"
PING, READ, WRITE, STATUS, SYNC_READ, SYNC_WRITE = 0x01, 0x02, 0x03, 0x55, 0x82, 0x83
INSTRUCTION_ERROR, CRC_ERROR, RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR, ALERT = 2, 3, 4, 5, 6, 7, 0x80

MODEL, FIRMWARE, DRIVE_MODE, OPERATING_MODE, VELOCITY_LIMIT = 0, 6, 10, 11, 44
MOST, LEAST, TORQUE, TROUBLE, WATCHDOG = 48, 52, 64, 70, 98
PROFILE_VELOCITY, GOAL, CURRENT, VELOCITY, PRESENT, VOLTAGE, TEMPERATURE = 112, 116, 126, 128, 132, 144, 146
SIZES = {MODEL: 2, FIRMWARE: 1, DRIVE_MODE: 1, OPERATING_MODE: 1, VELOCITY_LIMIT: 4, MOST: 4, LEAST: 4, TORQUE: 1}
SIZES |= {TROUBLE: 1, WATCHDOG: 1, PROFILE_VELOCITY: 4, GOAL: 4, CURRENT: 2, VELOCITY: 4, PRESENT: 4}
SIZES |= {VOLTAGE: 2, TEMPERATURE: 1, 136: 4, 140: 4}
SIGNED = {GOAL, CURRENT, VELOCITY, PRESENT}
READ_ONLY = {MODEL, FIRMWARE, TROUBLE, CURRENT, VELOCITY, PRESENT, VOLTAGE, TEMPERATURE}
STEPS_PER_SECOND = 0.229 * 4096 / 60  # a unit of velocity


def crc(data: bytes) -> int:
    """CRC-16 of x^16 + x^15 + x^2 + 1, from 0, the highest bit first."""
    value = 0
    for byte in data:
        value ^= byte << 8
        for _ in range(8):
            value = (value << 1 ^ (0x8005 if value & 0x8000 else 0)) & 0xFFFF
    return value


def packet(number: int, instruction: int, parameters: bytes = b"") -> bytes:
    """With stuffing, length and CRC."""
    body = (bytes([instruction]) + parameters).replace(HEADER, HEADER + b"\xfd")
    head = HEADER + bytes([0, number]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc(head + body).to_bytes(2, "little")


class EmulatedServo:
    """A servo that turns at its profile velocity, at once where that is 0.

    `silent` it answers nothing, `garbled` with a wrong CRC, `frozen` it does not move any more; `powered` tells whether
    torque was ever on.
    """

    def __init__(self, number: int = 1, model: int = 1170, firmware: int = 45, present: int = 2048):
        self.number, self.silent, self.garbled, self.frozen, self.powered = number, False, False, False, False
        start = {MODEL: model, FIRMWARE: firmware, OPERATING_MODE: 3, VELOCITY_LIMIT: 167, MOST: 4095, GOAL: present}
        self.table = dict.fromkeys(SIZES, 0) | start | {PRESENT: present, VOLTAGE: 120, TEMPERATURE: 25}
        self.instructions: list[tuple[int, bytes]] = []
        self._position = float(present)
        self._moved = self._asked = time.monotonic()

    def alert(self, bits: int):
        """A hardware error takes the torque off."""
        self.table[TROUBLE], self.table[TORQUE] = bits, 0

    def advance(self):
        now = time.monotonic()
        passed, self._moved = now - self._moved, now
        watched = self.table[WATCHDOG]
        if self.table[TORQUE] and 0 < watched < 0xFF and now - self._asked > watched * 0.02:
            self.table[WATCHDOG], self.table[GOAL] = 0xFF, self.table[PRESENT]
        if self.table[TORQUE] and not self.frozen:
            most = (self.table[PROFILE_VELOCITY] or math.inf) * STEPS_PER_SECOND * passed
            self._position += max(-most, min(most, self.table[GOAL] - self._position))
            self.table[PRESENT] = round(self._position)

    def answer(self, number: int, instruction: int, parameters: bytes) -> bytes:
        """What it says to a packet, whoever it is for."""
        address, size = (int.from_bytes(parameters[k : k + 2], "little") for k in (0, 2))
        if instruction == SYNC_READ and self.number in parameters[4:]:
            told = self._read(address, size)
        elif instruction == SYNC_WRITE:
            given = {parameters[k]: parameters[k + 1 : k + 1 + size] for k in range(4, len(parameters), 1 + size)}
            if self.number in given:
                self._heard(instruction, parameters)
                self._write(address, given[self.number])
            return b""
        elif number not in (self.number, 0xFE) or instruction == SYNC_READ:
            return b""
        elif instruction == PING:
            told = self._status(0, self._bytes(MODEL) + self._bytes(FIRMWARE))
        elif instruction == READ:
            told = self._read(address, size)
        elif instruction == WRITE:
            told = self._status(self._write(address, parameters[2:]))
        else:
            told = self._status(INSTRUCTION_ERROR)
        self._heard(instruction, parameters)
        if self.silent:
            return b""
        return told[:-1] + bytes([told[-1] ^ 0x01]) if self.garbled else told

    def damaged(self) -> bytes:
        """What it says to a packet with a wrong CRC."""
        return self._status(CRC_ERROR)

    def _heard(self, instruction: int, parameters: bytes):
        self._asked = time.monotonic()
        self.instructions.append((instruction, parameters))

    def _read(self, address: int, size: int) -> bytes:
        """Registers from an address on, as many as fit to the size."""
        data, place = b"", address
        while len(data) < size and place in SIZES:
            data += self._bytes(place)
            place += SIZES[place]
        return self._status(0, data) if len(data) == size else self._status(ACCESS_ERROR)

    def _write(self, address: int, data: bytes) -> int:
        if address not in SIZES or address in READ_ONLY or (address < TORQUE and self.table[TORQUE]):
            return ACCESS_ERROR
        if len(data) != SIZES[address]:
            return LENGTH_ERROR
        value = int.from_bytes(data, "little", signed=address in SIGNED)
        if address == GOAL:
            if self.table[WATCHDOG] == 0xFF:
                return RANGE_ERROR
            if not self.table[LEAST] <= value <= self.table[MOST]:
                return LIMIT_ERROR
        if address == OPERATING_MODE:
            self.table[PROFILE_VELOCITY] = 0
        self.table[address] = value
        self.powered |= bool(self.table[TORQUE])
        return 0

    def _bytes(self, address: int) -> bytes:
        return self.table[address].to_bytes(SIZES[address], "little", signed=address in SIGNED)

    def _status(self, error: int, parameters: bytes = b"") -> bytes:
        return packet(self.number, STATUS, bytes([error | (ALERT if self.table[TROUBLE] else 0)]) + parameters)


class Emulator(OnAPty):
    """Servos on a bus; one, if none are given. To a packet for several they answer in its order."""

    def __init__(self, *servos: EmulatedServo):
        super().__init__()
        self.servos = {servo.number: servo for servo in servos or (EmulatedServo(),)}
        self._rest = b""

    @property
    def first(self) -> EmulatedServo:
        return next(iter(self.servos.values()))

    def hold(self, frozen: bool):
        """All of them are blocked."""
        for servo in self.servos.values():
            servo.frozen = frozen

    def garble(self, answer: bytes) -> bytes:
        return answer[:-1] + bytes([answer[-1] ^ 0x01])

    def advance(self):
        for servo in self.servos.values():
            servo.advance()

    def heard(self, data: bytes) -> bytes:
        self._rest += data
        answers = b""
        while (start := self._rest.find(HEADER)) >= 0:
            self._rest = self._rest[start:]
            if len(self._rest) < 7 or len(self._rest) < (end := 7 + int.from_bytes(self._rest[5:7], "little")):
                break
            whole, self._rest = self._rest[:end], self._rest[end:]
            answers += self._answer(whole)
        return answers

    def _answer(self, whole: bytes) -> bytes:
        number = whole[4]
        if crc(whole[:-2]) != int.from_bytes(whole[-2:], "little"):
            return self.servos[number].damaged() if number in self.servos else b""
        body = whole[7:-2].replace(HEADER + b"\xfd", HEADER)
        order = [self.servos[k] for k in body[5:] if k in self.servos] if body[0] == SYNC_READ else self.servos.values()
        return b"".join(servo.answer(number, body[0], body[1:]) for servo in order)

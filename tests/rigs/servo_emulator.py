"""A Dynamixel servo that speaks protocol 2.0, written from ROBOTIS' e-Manual and not from its SDK."""

import math
import time

from .on_a_pty import OnAPty

HEADER = b"\xff\xff\xfd"
PING, READ, WRITE, STATUS = 0x01, 0x02, 0x03, 0x55
INSTRUCTION_ERROR, CRC_ERROR, RANGE_ERROR, LENGTH_ERROR, LIMIT_ERROR, ACCESS_ERROR, ALERT = 2, 3, 4, 5, 6, 7, 0x80

MODEL, FIRMWARE, DRIVE_MODE, OPERATING_MODE, VELOCITY_LIMIT = 0, 6, 10, 11, 44
MOST, LEAST, TORQUE, TROUBLE, WATCHDOG = 48, 52, 64, 70, 98
PROFILE_VELOCITY, GOAL, PRESENT = 112, 116, 132
SIZES = {MODEL: 2, FIRMWARE: 1, DRIVE_MODE: 1, OPERATING_MODE: 1, VELOCITY_LIMIT: 4, MOST: 4, LEAST: 4, TORQUE: 1}
SIZES |= {TROUBLE: 1, WATCHDOG: 1, PROFILE_VELOCITY: 4, GOAL: 4, PRESENT: 4}
READ_ONLY = {MODEL, FIRMWARE, TROUBLE, PRESENT}
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


class Emulator(OnAPty):
    """One servo on a bus, which turns at its profile velocity, at once where that is 0."""

    def __init__(self, number: int = 1, model: int = 1170, firmware: int = 45, present: int = 2048):
        super().__init__()
        self.number = number
        start = {MODEL: model, FIRMWARE: firmware, OPERATING_MODE: 3, VELOCITY_LIMIT: 167, MOST: 4095, GOAL: present}
        self.table = dict.fromkeys(SIZES, 0) | start | {PRESENT: present}
        self.instructions: list[tuple[int, bytes]] = []
        self._position = float(present)
        self._moved = self._asked = time.monotonic()
        self._rest = b""

    def alert(self, bits: int):
        """A hardware error takes the torque off."""
        self.table[TROUBLE], self.table[TORQUE] = bits, 0

    def garble(self, answer: bytes) -> bytes:
        return answer[:-1] + bytes([answer[-1] ^ 0x01])

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
        if whole[4] not in (self.number, 0xFE):
            return b""
        self._asked = time.monotonic()
        if crc(whole[:-2]) != int.from_bytes(whole[-2:], "little"):
            return self._status(CRC_ERROR)
        body = whole[7:-2].replace(HEADER + b"\xfd", HEADER)
        instruction, parameters = body[0], body[1:]
        self.instructions.append((instruction, parameters))
        address = int.from_bytes(parameters[:2], "little")
        if instruction == PING:
            return self._status(0, self._bytes(MODEL) + self._bytes(FIRMWARE))
        if instruction == READ:
            if SIZES.get(address) != int.from_bytes(parameters[2:4], "little"):
                return self._status(ACCESS_ERROR)
            return self._status(0, self._bytes(address))
        if instruction == WRITE:
            return self._status(self._write(address, parameters[2:]))
        return self._status(INSTRUCTION_ERROR)

    def _write(self, address: int, data: bytes) -> int:
        if address not in SIZES or address in READ_ONLY or (address < TORQUE and self.table[TORQUE]):
            return ACCESS_ERROR
        if len(data) != SIZES[address]:
            return LENGTH_ERROR
        value = int.from_bytes(data, "little", signed=len(data) == 4)
        if address == GOAL:
            if self.table[WATCHDOG] == 0xFF:
                return RANGE_ERROR
            if not self.table[LEAST] <= value <= self.table[MOST]:
                return LIMIT_ERROR
        if address == OPERATING_MODE:
            self.table[PROFILE_VELOCITY] = 0
        self.table[address] = value
        return 0

    def _bytes(self, address: int) -> bytes:
        return self.table[address].to_bytes(SIZES[address], "little", signed=SIZES[address] == 4)

    def _status(self, error: int, parameters: bytes = b"") -> bytes:
        return packet(self.number, STATUS, bytes([error | (ALERT if self.table[TROUBLE] else 0)]) + parameters)

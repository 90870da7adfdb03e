"""A microcontroller with a motor and its speed loop, at the other end of a serial line."""

import math
import os
import random
import time

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from nectosome.controllers import VariableGainPI
from nectosome.controllers.pid import ActuatorLimits

from .on_a_pty import OnAPty

DT = 0.005  # of the loop [s]
INERTIA, DRAG, FRICTION = 1e-3, 0.01, 0.02  # kg m2, N m s, N m
_MOST = jnp.asarray(1.0)
LAW = VariableGainPI(
    proportional=jnp.asarray(0.05),
    integral=jnp.asarray(1.0),
    boost=jnp.asarray(3.0),
    low=jnp.asarray(1.0),
    limits=ActuatorLimits(low=-_MOST, high=_MOST, slew=jnp.asarray(np.inf)),
)


@eqx.filter_jit
def _step(regulator, state, measured):
    return regulator.step(state, measured)


def framed(text: str) -> bytes:
    checksum = 0
    for byte in text.encode():
        checksum ^= byte << 8
        for _ in range(8):
            checksum = (checksum << 1 ^ (0x1021 if checksum & 0x8000 else 0)) & 0xFFFF
    return f"{text}*{checksum:04X}\n".encode()


class Microcontroller(OnAPty):
    """`blind`: it does not know its speed; `powered` tells whether it was ever driven."""

    def __init__(self):
        super().__init__()
        self.speed, self.torque, self.blind = 0.0, 0.0, False
        self.asked: list[str] = []
        self.set_speed, self.watchdog, self.expired, self.driven = 0.0, 0.0, False, False
        self._drive(0.0)
        _step(self._regulator, self._state, jnp.asarray(0.0))  # compile
        self.driven = self.powered = False
        self._now = self._heard = time.monotonic()
        self._rest = b""

        self.version, self.samples, self.damaged, self.last = 1, 0, 0, None

    def garble(self, answer: bytes) -> bytes:
        return answer[:-2] + (b"0" if answer[-2:-1] != b"0" else b"1") + b"\n"

    def advance(self):
        now = time.monotonic()
        if self.watchdog and now - self._heard > self.watchdog and not self.expired:
            self.expired = True
            self._vent()
        while self._now + DT < now:
            self._now += DT
            self.samples += 1
            if self.driven:
                self._state, torque = _step(self._regulator, self._state, jnp.asarray(self.speed))
                self.torque = float(torque)
            if not self.frozen:
                self._turn()

    def _turn(self):
        pull = self.torque - DRAG * self.speed
        if self.speed == 0 and abs(pull) <= FRICTION:
            return
        way = math.copysign(1.0, self.speed or pull)
        after = self.speed + DT / INERTIA * (pull - way * FRICTION)
        self.speed = 0.0 if after * way < 0 else after  # friction stops, it does not turn round

    def _drive(self, speed: float):
        self.set_speed, self.driven, self.powered = speed, True, True
        self._regulator = LAW.planned(np.array([speed]), DT)
        self._state = self._regulator.initial(self.torque, self.speed)

    def _vent(self):
        self.set_speed, self.torque, self.driven = 0.0, 0.0, False

    def heard(self, data: bytes) -> bytes:
        *lines, self._rest = (self._rest + data).split(b"\n")
        return b"".join(framed(self._answer(line.decode())) for line in lines)

    def _answer(self, line: str) -> str:
        text = line.rpartition("*")[0]
        if framed(text) != line.encode() + b"\n":
            self.damaged += 1
            return f"{self.version} 0 E damaged"
        version, number, question = text.split(" ", 2)
        if int(version) != self.version:
            return f"{self.version} {number} E version"
        if self.last is not None and 1 <= (self.last - int(number)) % 256 <= 127 and question not in ("H", "0"):
            return f"{self.version} {number} E old"
        self.last = int(number)
        return f"{self.version} {number} {self._told(question)}"

    def _told(self, question: str) -> str:
        self.asked.append(question)
        self._heard = time.monotonic()
        match question.split():
            case ["H"]:
                return f"H {DT}"
            case ["0"]:
                self.expired = False
                self._vent()
                return "0"
            case ["W", seconds]:
                self.watchdog = float(seconds)
                return question
            case ["S", _] if self.expired:
                return "E watchdog"
            case ["S", speed]:
                self._drive(float(speed))
            case ["R"]:
                pass
            case _:
                return "E unknown"
        speed = math.nan if self.blind else self.speed
        state = "watchdog" if self.expired else "on" if self.driven else "off"
        told = f"{speed:.4f} {self.set_speed - speed:.4f} {self.torque:.4f} {state} {self.damaged}"
        return f"V {self.samples} {told}"


class OverRadio(Microcontroller):
    """Behind a radio link, which loses a share of lines in both directions and delivers a share late, in any order."""

    def __init__(self, lost: float, delayed: float, longest: float, seed: int = 1):
        super().__init__()
        self.lost, self.delayed, self.longest, self.random = lost, delayed, longest, random.Random(seed)
        self._piece = b""
        self._air: list[tuple[float, bool, bytes]] = []  # when it arrives [s], whether it is a question, the line

    def heard(self, data: bytes) -> bytes:
        *lines, self._piece = (self._piece + data).split(b"\n")
        for line in lines:
            self._send(True, line + b"\n")
        return b""

    def advance(self):
        super().advance()
        now = time.monotonic()
        due = sorted(one for one in self._air if one[0] <= now)
        self._air = [one for one in self._air if one[0] > now]
        for _, asked, line in due:
            if asked:
                self._send(False, super().heard(line))
            else:
                os.write(self._end, line)

    def _send(self, asked: bool, line: bytes):
        if self.random.random() >= self.lost:
            late = self.random.uniform(0.0, self.longest) if self.random.random() < self.delayed else 0.0
            self._air.append((time.monotonic() + late, asked, line))

r"""A motor whose speed loop runs on a microcontroller, over a serial line: a cable, or Bluetooth.

Both sides speak in lines of ASCII, `text*XX` and a line feed, where XX is the exclusive or of the bytes of the text in
two hexadecimal digits, as in NMEA 0183. Every question has one answer:

| question | does | answer |
|---|---|---|
| `S 12.5` | sets the speed [rad/s] | `V speed error` |
| `R` | nothing | `V speed error`: as measured, and what the speed set is more [rad/s]; `nan` where it is not known |
| `W 0.5` | sets the controller's own watchdog [s]: without a question for so long it vents | `W 0.5` |
| `0` | vents: no voltage, speed 0, forgets that the watchdog has vented | `0` |

A question that is not understood is answered `E` and why; `S` is answered `E watchdog` after the watchdog has vented.
The law of the speed loop is `nectosome.controllers.VariableGainPI`.
"""

import math
import time
from dataclasses import dataclass
from functools import partial, reduce
from operator import xor
from typing import Any

from nectosome.units import InputError

from .rig import Rig, RigError, driver, line, retried


@dataclass(frozen=True)
class MotorLink:
    """A motor on a serial line: where its controller is and how long it is waited for."""

    port: str
    """Serial port, as in /dev/ttyACM0 or COM3."""
    baud: int = 115_200
    """Baud rate of the line."""
    timeout: float = 0.1  # [s]
    """Time in which an answer has to come."""
    start: float = 3.0  # [s]
    """Wait after the port is opened, which resets an Arduino."""
    watchdog: float = 0.5  # [s]
    """Time without a question after which the controller vents by itself; several times dt."""

    def __post_init__(self):
        for name in ("timeout", "start", "watchdog"):
            if not getattr(self, name) > 0:
                raise InputError(f"{getattr(self, name):g} s; a time above 0 s expected.", field=name)


def framed(text: str) -> bytes:
    """A line with its checksum."""
    return f"{text}*{_checksum(text):02X}\n".encode("ascii")


def unframed(data: bytes) -> str | None:
    """The text of a line; None where it is not whole."""
    text, star, digits = data.decode("ascii", "replace").rstrip("\r\n").rpartition("*")
    return text if star and digits == f"{_checksum(text):02X}" else None


def _checksum(text: str) -> int:
    return reduce(xor, text.encode("ascii", "replace"), 0)


class SerialMotor(Rig):
    """Speed [rad/s] in, speed [rad/s] out."""

    name = "serial motor"
    command_unit = "rad/s"
    measured_unit = "rad/s"

    def __init__(self, controller: MotorLink):
        self.controller = controller
        self._where = f"motor at {controller.port}"
        self._port: Any = None
        self.commanded = False

    def open(self) -> None:
        """Wait until the controller runs, set its watchdog, and a speed of 0."""
        c = self.controller
        serial = driver("serial", "rig")
        with line(self._where):
            self._port = serial.Serial(c.port, c.baud, timeout=c.timeout, write_timeout=c.timeout, exclusive=True)
        limit = time.perf_counter() + c.start
        while True:
            try:
                self._ask("0")
                break
            except RigError as error:
                if error.__cause__ or time.perf_counter() > limit:  # a broken line stays so
                    raise
        self._ask(f"W {c.watchdog:g}")
        self.write(0.0)

    def measure(self) -> float:
        """The speed; NaN where the controller does not know."""
        return self._speed(self._ask("R"))

    def write(self, command: float) -> None:
        """The speed to hold."""
        if not math.isfinite(command):
            raise RigError(f"{self._where}: a command of {command:g} rad/s is no speed.")
        self.commanded = True
        self._speed(self._ask(f"S {command:.4f}"))

    def vent(self) -> None:
        """No voltage, tried three times."""
        if self._port is not None:
            retried(partial(self._ask, "0"), "It should stop by its own watchdog; else switch off its power.")

    def close(self) -> None:
        """Release the port."""
        port, self._port = self._port, None
        if port is not None:
            with line(self._where):
                port.close()

    def _ask(self, question: str) -> str:
        """The answer to a question, without its letter; other lines are ignored."""
        if self._port is None:
            raise RigError(f"{self._where}: used before it was opened.")
        letter = {"S": "V", "R": "V"}.get(question[0], question[0])
        with line(self._where):
            self._port.reset_input_buffer()
            self._port.write(framed(question))
            limit = time.perf_counter() + self.controller.timeout
            garbled = None
            while time.perf_counter() < limit:
                data = self._port.read_until(b"\n")
                answer = unframed(data)
                if answer is None:
                    garbled = data or garbled
                elif answer[:1] == letter:
                    return answer[1:].strip()
                elif answer[:1] == "E":
                    raise RigError(self._refused(question, answer[1:].strip()))
        waited = f"no answer to {question!r} in {self.controller.timeout:g} s"
        if garbled:
            raise RigError(
                f"{self._where}: {waited}, but {garbled!r}. Look at the baud rate ({self.controller.baud} expected),"
                " the cable's screen, and whether the controller speaks this protocol."
            )
        raise RigError(f"{self._where}: {waited}. Look at its power, the cable, and whether Bluetooth is paired.")

    def _refused(self, question: str, why: str) -> str:
        if why == "watchdog":
            return (
                f"{self._where}: it has stopped by itself, since no question came for {self.controller.watchdog:g} s. "
                "Look at what holds up the loop."
            )
        return f"{self._where}: {question!r} was refused: {why}. Look at the program of the controller."

    def _speed(self, answer: str) -> float:
        try:
            speed, _ = map(float, answer.split())
        except ValueError as error:
            raise RigError(
                f"{self._where}: {answer!r} is no speed and error. Look at the program of the controller."
            ) from error
        return speed

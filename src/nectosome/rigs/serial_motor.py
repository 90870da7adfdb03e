r"""A motor whose speed loop runs on a microcontroller, over a serial line: a cable, or Bluetooth.

Both sides speak in lines of ASCII, `version number letter values*XXXX` and a line feed, where XXXX is the CRC-16/XMODEM
of the text before the star (docs/reference/serial-protocol.md). Every question has one answer, with its number:

| question | does | answer |
|---|---|---|
| `H` | nothing | `H dt`: time between samples of the speed loop [s] |
| `S 12.5` | sets the speed [rad/s] | `V` as below |
| `R` | nothing | `V sample speed error share state damaged` |
| `W 0.5` | sets the controller's own watchdog [s]: without a question for so long it vents | `W 0.5` |
| `0` | vents: no voltage, speed 0, forgets that it has vented or was reset by itself | `0` |

What is refused is answered `E` and why. `firmware/` has such a controller; the law of its speed loop is
`nectosome.controllers.VariableGainPI`.
"""

import math
import time
from binascii import crc_hqx
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

from nectosome.units import InputError

from .rig import Rig, RigError, driver, line, retried

VERSION = 1
"""Version of the protocol, the first word of every line."""


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
    return f"{text}*{_checksum(text):04X}\n".encode("ascii")


def unframed(data: bytes) -> str | None:
    """The text of a line; None where it is not whole."""
    text, star, digits = data.decode("ascii", "replace").rstrip("\r\n").rpartition("*")
    return text if star and digits == f"{_checksum(text):04X}" else None


def _checksum(text: str) -> int:
    return crc_hqx(text.encode("ascii", "replace"), 0)


class MotorState(NamedTuple):
    """What the controller has told of its last sample."""

    sample: int
    """Samples since its reset."""
    speed: float
    """As measured [rad/s]; NaN where it is not known."""
    error: float
    """What the speed that was set is more [rad/s]."""
    share: float
    """Share of the voltage, -1 to 1."""
    state: str
    """`on`, `off` (vented), or vented by itself: `watchdog`, `reset`."""
    damaged: int
    """Questions with a wrong checksum since its reset."""


class _UnheardError(RigError):
    """No answer, or a question that did not arrive: what a controller that is not ready yet does."""


class SerialMotor(Rig):
    """Speed [rad/s] in, speed [rad/s] out."""

    name = "serial motor"
    command_unit = "rad/s"
    measured_unit = "rad/s"

    def __init__(self, controller: MotorLink):
        self.controller = controller
        self.told: MotorState | None = None
        self.sample_time = math.nan  # of the controller [s]
        self._where = f"motor at {controller.port}"
        self._port: Any = None
        self._number = 0
        self.commanded = False

    def open(self) -> None:
        """Wait until the controller runs, ask for its version, set its watchdog, and a speed of 0."""
        c = self.controller
        serial = driver("serial", "rig")
        with line(self._where):
            self._port = serial.Serial(c.port, c.baud, timeout=c.timeout, write_timeout=c.timeout, exclusive=True)
        limit = time.perf_counter() + c.start
        while True:
            try:
                told = self._ask("H")
                break
            except _UnheardError:
                if time.perf_counter() > limit:
                    raise
        try:
            (self.sample_time,) = map(float, told)
        except ValueError as error:
            raise self._nonsense(told) from error
        self._ask("0")
        self._ask(f"W {c.watchdog:g}")
        self.write(0.0)

    def measure(self) -> float:
        """The speed; NaN where the controller does not know."""
        return self._state(self._ask("R"))

    def write(self, command: float) -> None:
        """The speed to hold."""
        if not math.isfinite(command):
            raise RigError(f"{self._where}: a command of {command:g} rad/s is no speed.")
        self.commanded = True
        self._state(self._ask(f"S {command:.4f}"))

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

    def _ask(self, question: str) -> list[str]:
        """The words of the answer to a question, without its letter; other lines are ignored."""
        if self._port is None:
            raise RigError(f"{self._where}: used before it was opened.")
        self._number = (self._number + 1) % 256
        letter = {"S": "V", "R": "V"}.get(question[0], question[0])
        with line(self._where):
            self._port.reset_input_buffer()
            self._port.write(framed(f"{VERSION} {self._number} {question}"))
            limit = time.perf_counter() + self.controller.timeout
            garbled = None
            while time.perf_counter() < limit:
                data = self._port.read_until(b"\n")
                fields = (unframed(data) or "").split()
                if len(fields) < 3:
                    garbled = data or garbled
                    continue
                version, number, said, *words = fields
                if version != str(VERSION):
                    raise RigError(
                        f"{self._where}: it speaks version {version} of the protocol, this program version {VERSION}. "
                        "Flash the firmware that came with this version of nectosome."
                    )
                if said == "E" and (number == str(self._number) or words == ["damaged"]):
                    self._refuse(question, " ".join(words))
                if said == letter and number == str(self._number):
                    return words
        waited = f"no answer to {question!r} in {self.controller.timeout:g} s"
        if garbled:
            raise _UnheardError(
                f"{self._where}: {waited}, but {garbled!r}. Look at the baud rate ({self.controller.baud} expected),"
                " the cable's screen, and whether the controller speaks this protocol."
            )
        raise _UnheardError(f"{self._where}: {waited}. Look at its power, the cable, and whether Bluetooth is paired.")

    def _refuse(self, question: str, why: str) -> None:
        """Raise what a refusal means."""
        if why == "damaged":
            raise _UnheardError(
                f"{self._where}: {question!r} arrived damaged. Look at the cable's screen, and at the baud rate "
                f"({self.controller.baud} expected)."
            )
        if why == "watchdog":
            raise RigError(
                f"{self._where}: it has stopped by itself, since no question came for {self.controller.watchdog:g} s. "
                "Look at what holds up the loop."
            )
        if why == "reset":
            raise RigError(
                f"{self._where}: it has stopped by itself, since it was reset. "
                "Look at its supply: a motor that starts may pull it down."
            )
        raise RigError(f"{self._where}: {question!r} was refused: {why}. Look at the program of the controller.")

    def _state(self, words: list[str]) -> float:
        """Keep what was told; the speed in it."""
        try:
            sample, speed, error, share, state, damaged = words
            self.told = MotorState(int(sample), float(speed), float(error), float(share), state, int(damaged))
        except ValueError as wrong:
            raise self._nonsense(words) from wrong
        return self.told.speed

    def _nonsense(self, words: list[str]) -> RigError:
        said = " ".join(words)
        return RigError(f"{self._where}: {said!r} is no answer. Look at the program of the controller.")

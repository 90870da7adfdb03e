"""Questions and answers over a serial line, a cable or a radio link (docs/reference/serial-protocol.md).

Both sides speak in lines of ASCII, `version number letter values*XXXX` and a line feed, where XXXX is the CRC-16/XMODEM
of the text before the star. Every question has one answer, with its number. A question without an answer is asked again
with the same number: to be asked twice does what once does.

Several devices behind one microcontroller share its port (`SerialLine.share`) and its numbers, and ask in turn.
"""

import time
from binascii import crc_hqx
from collections.abc import Mapping
from dataclasses import dataclass, field
from itertools import combinations
from typing import Annotated, Any

from pydantic import Field

from nectosome.description.fields import PositiveTime
from nectosome.units import InputError

from ..device_files import Baud, Word
from ..rig import Rig, RigError, driver, line

VERSION = 1
"""Version of the protocol, the first word of every line."""
_TICK = 0.01  # longest wait for one byte [s]: a time limit is kept within it
_LONGEST = 4096  # bytes without a line feed: of no answer


@dataclass(frozen=True)
class SerialLink:
    """A microcontroller on a serial line, and how long it is waited for."""

    port: Word
    """Serial port, as in /dev/ttyACM0 or COM3."""
    baud: Baud = 115_200
    """Baud rate of the line."""
    timeout: PositiveTime = 0.1  # [s]
    """Time in which an answer has to come."""
    attempts: Annotated[int, Field(ge=1, le=100)] = 1
    """Times that a question is asked before the line counts as broken: a radio link loses some. A command takes at most
    so many times the timeout."""
    start: PositiveTime = 3.0  # [s]
    """Wait after the port is opened, which resets an Arduino."""

    def __post_init__(self):
        for name in ("timeout", "start"):
            if not getattr(self, name) > 0:
                raise InputError(f"{getattr(self, name):g} s; a time above 0 s expected.", field=name)
        if self.attempts < 1:
            raise InputError(f"{self.attempts}; 1 or more expected.", field="attempts")


def framed(text: str) -> bytes:
    """A line with its checksum."""
    return f"{text}*{_checksum(text):04X}\n".encode("ascii")


def unframed(data: bytes) -> str | None:
    """The text of a line; None where it is not whole."""
    text, star, digits = data.decode("ascii", "replace").rstrip("\r\n").rpartition("*")
    return text if star and digits == f"{_checksum(text):04X}" else None


def _checksum(text: str) -> int:
    return crc_hqx(text.encode("ascii", "replace"), 0)


class UnheardError(RigError):
    """No answer, or a question that did not arrive: what a controller that is not ready yet does."""


class RefusedError(RigError):
    """A question that was refused; `why` is the word of the answer."""

    def __init__(self, message: str, why: str):
        super().__init__(message)
        self.why = why


@dataclass
class SerialPort:
    """A serial port of this process, its counts of all questions, and the lines that have it open."""

    asked: int = 0
    """Questions so far."""
    lost: int = 0
    """Times that a question got no answer in its time, or arrived damaged."""
    late: int = 0
    """Answers to a question that is over, which were dropped."""
    device: Any = None
    users: "set[SerialLine]" = field(default_factory=set)
    rest: bytes = b""
    """What came after the last line."""


class SerialLine:
    """Asks what is at the other end of a serial line, for one device; `port` may be that of several."""

    def __init__(self, link: SerialLink, where: str):
        self.link, self.where = link, f"{where} at {link.port}"
        self.port = SerialPort()

    def share(self, other: "SerialLine") -> None:
        """Take the port of another line, for a device behind the same controller."""
        self.port = other.port

    @property
    def is_open(self) -> bool:
        """Whether this device may speak over the port."""
        return self in self.port.users

    def open(self) -> list[str]:
        """Wait until the controller runs; what it says to `H`. A port that is open stays so."""
        link, port, serial = self.link, self.port, driver("serial", "rig")
        if not port.users:
            wait = min(link.timeout, _TICK)
            with line(self.where):
                port.device = serial.Serial(
                    link.port, link.baud, timeout=wait, write_timeout=link.timeout, exclusive=True
                )
            port.rest = b""
        port.users.add(self)
        limit = time.perf_counter() + link.start
        while True:
            try:
                return self.ask("H", "H")
            except UnheardError:
                if time.perf_counter() > limit:
                    raise

    def close(self) -> None:
        """Release the port; it is closed with the last device."""
        if self.is_open:
            self.port.users.remove(self)
            if not self.port.users:
                with line(self.where):
                    self.port.device.close()

    def ask(self, question: str, letter: str) -> list[str]:
        """The words of the answer to a question, after its letter. Raises RigError."""
        if not self.is_open:
            raise RigError(f"{self.where}: used before it was opened.")
        self.port.asked += 1
        number = str(self.port.asked % 256)
        for left in reversed(range(self.link.attempts)):
            try:
                return self._once(question, letter, number)
            except UnheardError:
                if not left:
                    raise
        raise AssertionError("asked at least once")

    def _once(self, question: str, letter: str, number: str) -> list[str]:
        with line(self.where):
            limit = time.perf_counter() + self.link.timeout
            self.port.device.write(framed(f"{VERSION} {number} {question}"))
            garbled = None
            while (data := self._line(limit)) is not None:
                fields = (unframed(data) or "").split()
                if len(fields) < 3:
                    garbled = data.strip() or garbled
                    continue
                version, told, said, *words = fields
                if version != str(VERSION):
                    raise RigError(
                        f"{self.where}: it speaks version {version} of the protocol, this program version {VERSION}. "
                        "Flash the firmware that came with this version of nectosome."
                    )
                if said == "E" and words == ["damaged"]:
                    raise self._unheard(
                        f"{question!r} arrived damaged. Look at the cable's screen, and at the baud rate "
                        f"({self.link.baud} expected)."
                    )
                if told != number:
                    self.port.late += 1
                elif said == "E":
                    why = " ".join(words)
                    text = f"{self.where}: {question!r} was refused: {why}. Look at the program of the controller."
                    raise RefusedError(text, why)
                elif said == letter:
                    return words
        tries = f" at {self.link.attempts} attempts" if self.link.attempts > 1 else ""
        waited = f"no answer to {question!r} in {self.link.timeout:g} s{tries}"
        hint = "Look at its power, the cable, and whether the radio link stands."
        if garbled:
            waited += f", but {garbled!r}"
            hint = (
                f"Look at the baud rate ({self.link.baud} expected), the cable's screen, and whether the controller "
                "speaks this protocol."
            )
        raise self._unheard(f"{waited}. {hint}")

    def _line(self, limit: float) -> bytes | None:
        """The next line; None where none is whole before a time."""
        port = self.port
        while b"\n" not in port.rest:
            if time.perf_counter() >= limit:
                return None
            port.rest = (port.rest + port.device.read(port.device.in_waiting or 1))[-_LONGEST:]
        data, _, port.rest = port.rest.partition(b"\n")
        return data + b"\n"

    def _unheard(self, text: str) -> UnheardError:
        """The error of a question that got no answer, with what the line has lost so far."""
        port = self.port
        port.lost += 1
        counts = f"Of {port.asked} questions {port.lost} got no answer in time; {port.late} answers came too late."
        return UnheardError(f"{self.where}: {text} {counts}")


_SAME = "baud", "timeout", "attempts", "start"


def share_ports(rigs: Mapping[str, Rig], given: Mapping[str, Any]) -> None:
    """Let devices of different kinds behind one microcontroller, as a motor and an IMU, speak over one line, in turn.

    `given` are the fields of the devices as written. Raises InputError, with the field of the later device, where two
    of one port are no such pair, and for settings of the line that differ.
    """
    with_port = [(name, device) for name, device in given.items() if hasattr(device, "port")]
    for (first, one), (second, other) in combinations(with_port, 2):
        if one.port != other.port:
            continue
        mine, its = (getattr(rigs[name], "line", None) for name in (second, first))
        if not (isinstance(mine, SerialLine) and isinstance(its, SerialLine)) or one.kind == other.kind:
            raise InputError(
                f'{other.port} is the port of "{first}" too. A port takes one device, or a `serial` and a `serial_imu` '
                "of one microcontroller; servos on one bus are one device with several `servos`.",
                field=f"{second}.port",
            )
        for name in _SAME:
            here, there = getattr(other, name), getattr(one, name)
            if here != there:
                raise InputError(
                    f'{here:g}, and {there:g} for "{first}" at the same port: they share its line. Write one value.',
                    field=f"{second}.{name}",
                )
        mine.share(its)

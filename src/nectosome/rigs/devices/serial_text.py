"""A microcontroller that prints numbers, a line of text for each reading, and takes commands as lines of text.

Such lines have no checksum: a line without the right number of columns, or with something else than a number in one
that is read, is skipped and counted. The newest whole line that has come since the last sample is the measurement.
"""

import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Annotated, Any

from pydantic import Field

from nectosome.description.fields import Name, PositiveTime
from nectosome.units import InputError, count, shorten

from ..device_files import Baud, FileFields, Word, device_model
from ..rig import FileZero, Rig, RigError, driver, each, line, retried
from .text_scale import CommandText, ScaleFields, TextScale

_TICK = 0.01  # longest wait for one byte [s]: a time limit is kept within it
_FLUSH = 0.2  # after a port is opened, in which a board that resets then still sends its old lines [s]
_LONGEST = 4096  # bytes without a line feed: of no line
_FULL = 4000  # bytes that wait, of 4096 that a terminal keeps: later ones may be lost
_REFILL = 0.02  # in which a buffer that was full gets what waited behind it [s]
_WRAP = 2**32  # where a count of millis() or micros() begins again

Column = Annotated[int, Field(ge=1, le=100)]


@dataclass(frozen=True)
class PrintedNumber:
    """A number of each line: which it is, and what it says."""

    column: int
    """Which word of a line it is, from 1."""
    scale: TextScale


@dataclass(frozen=True)
class SentCommand:
    """A command that is sent as text."""

    write: str
    """Text with one field in braces for the number."""
    scale: TextScale

    def text(self, command: float) -> bytes:
        """What is sent for a command, in its SI unit. Raises RigError beyond what the device takes."""
        return self.write.format(self.scale.number(command)).encode("ascii")


@dataclass(frozen=True)
class PrintingBoard:
    """A microcontroller, such as an Arduino, that prints a line of numbers for each reading."""

    port: Word
    """Serial port, as in /dev/ttyACM0 or COM3."""
    inputs: Mapping[str, PrintedNumber]
    """Measurements: numbers of each line."""
    outputs: Mapping[str, SentCommand] = field(default_factory=dict)
    """Commands, each sent as a text of its own; the board does not acknowledge them."""
    baud: Baud = 115_200
    """Baud rate of the line."""
    separator: str | None = None
    """What stands between the columns of a line, as in ","; left out, white space."""
    columns: Column | None = None
    """Columns of a whole line; left out, the last one that is read is the last one of the line."""
    clock: Column | None = None
    """Column with a time or a number that only grows while the board runs, as that of millis(): where it goes back the
    board has restarted, which ends a run."""
    timeout: PositiveTime = 0.5  # [s]
    """Time in which a new line has to come; longer than the board takes for a reading."""
    start: PositiveTime = 3.0  # [s]
    """Time in which the first line has to come after the port is opened, which resets an Arduino."""

    def __post_init__(self):
        if not self.inputs:
            raise InputError("there are none: without lines nobody knows whether the board runs.", field="inputs")
        if self.separator == "":
            raise InputError("is empty. Leave it out for white space.", field="separator")
        for name in ("timeout", "start"):
            if not getattr(self, name) > 0:
                raise InputError(f"{getattr(self, name):g} s; a time above 0 s expected.", field=name)
        beyond = {f"inputs.{name}.column": one.column for name, one in self.inputs.items()} | {"clock": self.clock or 1}
        for at, column in beyond.items():
            if column > self.width:
                raise InputError(f"{column}, and a line has {count(self.width, 'column')}.", field=at)

    @property
    def width(self) -> int:
        """Columns of a whole line."""
        return self.columns or max(self.clock or 1, *(one.column for one in self.inputs.values()))


class PrintedColumn(ScaleFields):
    """A number of each line: which it is, and what it says; beyond low and high there is no measurement."""

    column: Column
    """Which column of a line it is, from 1."""


class SentText(ScaleFields):
    """A command that is sent as text: the number in it is zero at a command of 0."""

    write: CommandText
    """Text with the place of the number in braces and its decimals, as in "A{:.1f}"; a line feed is added where it has
    none."""


class SerialText(Rig):
    """Numbers of printed lines in, commands as text out.

    It is an error where its clock goes back, or no whole line comes in time; `remarks` counts skipped lines.
    """

    name = "serial text"
    described_by = device_model(
        "serial_text", PrintingBoard, inputs=dict[Name, PrintedColumn], outputs=dict[Name, SentText]
    )

    @classmethod
    def from_description(cls, given: Any, file: FileFields, dt: float) -> "SerialText":
        """Raises InputError for a scale that makes no sense."""
        inputs = {
            name: PrintedNumber(one.column, TextScale.of(one, file.within("inputs", name)))
            for name, one in given.inputs.items()
        }
        outputs = {
            name: SentCommand(one.write, TextScale.of(one, file.within("outputs", name)))
            for name, one in given.outputs.items()
        }
        for name, one in outputs.items():
            with file.within("outputs", name).errors():
                one.scale.check_rest()
        return cls(file.create(PrintingBoard, given, inputs=inputs, outputs=outputs))

    def __init__(self, board: PrintingBoard):
        self.board = board
        self.measurements = {name: one.scale.unit for name, one in board.inputs.items()}
        self.commands = {name: one.scale.unit for name, one in board.outputs.items()}
        self.where = f"board at {board.port}"
        self.commanded = self._opened = False
        self._port: Any = None
        self._forget()

    def _forget(self) -> None:
        """Know nothing of lines that came before."""
        self.lines = self.skipped = 0  # whole and others, since it was opened
        self._rest, self._cut = b"", True  # what came after the last line feed, and whether its beginning is missing
        self._last_skipped = self._came = ""  # of all, and since the last wait began
        self._clock, self._earlier = -math.inf, math.nan
        self._read = -math.inf  # when the last line was taken [s]

    def open(self) -> None:
        """Wait until the board prints, and send commands of 0."""
        self.connect()
        self._opened = True
        self.write([0.0] * len(self.commands))

    def connect(self) -> None:
        """Wait until the board prints; opening a port resets some."""
        board, serial = self.board, driver("serial", "rig")
        self._forget()
        with line(self.where):
            self._port = serial.Serial(
                board.port, board.baud, timeout=min(board.timeout, _TICK), write_timeout=board.timeout, exclusive=True
            )
            limit = time.perf_counter() + _FLUSH
            while time.perf_counter() < limit:
                self._port.read(self._port.in_waiting or 1)
        if self._next(board.start) is None:
            raise self._silent(board.start)
        self.lines, self.skipped = 1, 0  # what a board prints when it starts is no fault

    def measure(self) -> tuple[float, ...]:
        """Numbers of the newest line since the last sample, which is waited for; NaN beyond the range of a sensor."""
        if self._port is None:
            raise RigError(f"{self.where}: read before it was opened.")
        with line(self.where):
            self._drop_old()
        numbers = self._next(self.board.timeout)
        if numbers is None:
            raise self._silent(self.board.timeout)
        return tuple(one.scale.quantity(numbers[name]) for name, one in self.board.inputs.items())

    def _drop_old(self) -> None:
        """Take the lines that wait for nothing, where these may be old: after a pause, or where the newest are lost."""
        begin = now = time.perf_counter()
        if begin - self._read > self.board.timeout or self._port.in_waiting >= _FULL:
            while now < begin + _REFILL or (self._port.in_waiting and now < begin + self.board.timeout):
                self._take()
                now = time.perf_counter()

    def _next(self, seconds: float) -> dict[str, float] | None:
        """The numbers of the newest line that waits, or of the next one in some time; None where there is none."""
        limit, newest, self._came = time.perf_counter() + seconds, None, ""
        with line(self.where):
            while time.perf_counter() < limit and (newest is None or self._port.in_waiting):
                newest = self._take() or newest
        if newest is not None:
            self._read = time.perf_counter()
        return newest

    def _take(self) -> dict[str, float] | None:
        """The numbers of the newest line among the bytes that wait, or in the next one."""
        newest = None
        for text in self._split(self._port.read(self._port.in_waiting or 1)):
            newest = self._numbers(text) or newest
        return newest

    def _split(self, data: bytes) -> list[str]:
        """Whole lines, as far as they have come."""
        *lines, self._rest = (self._rest + data).split(b"\n")
        if len(self._rest) > _LONGEST:
            self._rest, self._cut = self._rest[-_LONGEST:], True
        if lines and self._cut:
            self._cut, lines = False, lines[1:]
        return [text for text in (one.decode("ascii", "replace").strip() for one in lines) if text]

    def _numbers(self, text: str) -> dict[str, float] | None:
        """The numbers of a line, by the names of their measurements; None where it is none. Raises RigError."""
        board = self.board
        self.lines += 1
        words = text.split(board.separator)
        try:
            if len(words) != board.width:
                raise ValueError
            numbers = {name: _number(words[one.column - 1]) for name, one in board.inputs.items()}
            if board.clock is not None and not self._goes_on(_number(words[board.clock - 1])):
                raise ValueError
        except ValueError:
            self.skipped += 1
            self._last_skipped = self._came = text
            return None
        return numbers

    def _goes_on(self, now: float) -> bool:
        """Whether the clock of a line is not before that of the last one. Raises RigError after a restart.

        A line that is cut at its beginning may be earlier too: only one after it, between both, tells of a restart.
        """
        wrapped = self._clock > now >= 0 and now + _WRAP - self._clock < _WRAP / 100
        if now >= self._clock or wrapped:
            self._clock, self._earlier = now, math.nan
            return True
        if now >= self._earlier:
            raise RigError(
                f"{self.where}: it has restarted, since its clock went back from {self._clock:.15g} to "
                f"{self._earlier:.15g}. Look at its supply, which a servo may pull down, and at its watchdog."
            )
        if not math.isnan(now):
            self._earlier = now
        return False

    def _silent(self, waited: float) -> RigError:
        """The error where no line came, with what came instead."""
        board, came = self.board, self._came or self._rest.decode("ascii", "replace").strip()
        text = f"{self.where}: no new line with {count(board.width, 'column')} in {waited:g} s"
        if not came:
            return RigError(f"{text}. Look at its power, the cable, and its program: does it print all the time?")
        text, baud = f"{text}, but {shorten(ascii(came), 80)}", f"the baud rate ({board.baud} expected)"
        if not (came.isascii() and came.isprintable()):
            return RigError(f"{text}. Look at {baud} and the cable.")
        words = len(came.split(board.separator))
        said = "has a word that is no number" if math.isnan(self._earlier) else "has an earlier clock"
        if words != board.width:
            said = f"has {count(words, 'column')}"
        fields = "separator and columns in the rig file"
        return RigError(f"{text}, which {said}. Look at {fields}, whether it has restarted, and at {baud}.")

    def write(self, commands: Sequence[float]) -> None:
        """Send all commands."""
        texts = [self._text(name, command) for name, command in zip(self.commands, commands, strict=True)]
        if not self._opened:
            raise RigError(f"{self.where}: written before it was opened.")
        self.commanded |= bool(texts)
        if texts:
            self._send(b"".join(texts))

    def _send(self, data: bytes) -> None:
        with line(self.where):
            self._port.write(data)

    def check_command(self, name: str, command: float) -> None:
        """Raise RigError for a command beyond what its device takes."""
        self._text(name, command)

    def _text(self, name: str, command: float) -> bytes:
        try:
            return self.board.outputs[name].text(command)
        except RigError as error:
            raise RigError(f"{self.where}: {name}: {error}") from None

    def zero_of(self, name: str) -> FileZero:
        """That of the number in a line, or of the quantity where its unit is printed."""
        scale = self.board.inputs[name].scale
        return FileZero(("inputs", name), *scale.zero_in_file)

    def remarks(self) -> list[str]:
        """How many lines were skipped."""
        if not self.skipped:
            return []
        return [
            f"{self.where}: {self.skipped} of {count(self.lines, 'line')} skipped, the last one "
            f"{shorten(ascii(self._last_skipped), 40)}. Look at the cable and at the program of the board."
        ]

    def vent(self) -> None:
        """Commands of 0, whatever becomes of the others; each is tried three times."""
        if self._opened:
            otherwise = "Switch off its power."
            rest = [one.text(0.0) for one in self.board.outputs.values()]
            each(partial(retried, partial(self._send, text), otherwise) for text in rest)

    def close(self) -> None:
        """Release the port; the board keeps its last commands."""
        port, self._port, self._opened = self._port, None, False
        if port is not None:
            with line(self.where):
                port.close()


def _number(word: str) -> float:
    """A printed number; NaN where it is infinite or none. Raises ValueError for another word."""
    if "_" in word:
        raise ValueError
    number = math.nan if word.strip() == "ovf" else float(word)  # as an Arduino prints what is too large
    return number if math.isfinite(number) else math.nan

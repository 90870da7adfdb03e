"""A microcontroller that prints lines of text: a load cell, which the angle of a servo bends, at 100 Hz."""

import re
import time

from .on_a_pty import OnAPty

REST, PER_DEGREE, MIDDLE = 80_000, 1_000, 90.0  # counts, counts/deg, deg


class PrintingStandIn(OnAPty):
    """Prints `millis,counts` each `interval` [s], and takes `A90.0`.

    What is `said` comes once instead of a line, `quiet` it prints nothing by itself; `load` [counts] is added.
    """

    def __init__(self, interval: float = 0.01):
        super().__init__()
        self.interval, self.load, self.quiet, self.angle = interval, 0, False, MIDDLE
        self.said: list[bytes] = []
        self.got: list[str] = []
        self.powered = False
        self._rest, self._bent, self._rounds = b"", 0, 0
        self._begun = self._next = time.monotonic()

    @property
    def driven(self) -> bool:
        """Whether it holds another angle than that of a command of 0."""
        return self.angle != MIDDLE

    def catch_up(self):
        """Wait until it has taken what was sent before, which it does not acknowledge."""
        until = self._rounds + 10
        while self._rounds < until and self._thread.is_alive():
            time.sleep(0.002)

    def restart(self, after: float = 0.0):
        """As by its watchdog; its clock begins anew."""
        self._begun = time.monotonic() + after

    def advance(self):
        self._rounds += 1

    def printed(self) -> bytes:
        said = b""
        while self.said:
            said += self.said.pop(0)
        now = time.monotonic()
        if self.quiet or now < self._next:
            return said
        self._next = max(self._next + self.interval, now - self.interval)
        return said + self.line(now)

    def line(self, now: float) -> bytes:
        """A line at a time [s]."""
        if not self.frozen:
            self._bent = round(PER_DEGREE * (self.angle - MIDDLE))
        counts = REST + self._bent + self.load
        return f"{round(1e3 * (now - self._begun))},{counts}\r\n".encode()

    def heard(self, data: bytes) -> bytes:
        *lines, self._rest = (self._rest + data).split(b"\n")
        for text in (one.decode() for one in lines):
            self.got.append(text)
            if found := re.fullmatch(r"A([\d.]+)", text):
                self.angle = float(found[1])
                self.powered |= self.driven
        return b""

    def garble(self, answer: bytes) -> bytes:
        """As at another baud rate."""
        return bytes(byte ^ 0xAA for byte in answer)

"""What long work is doing, for how long it has, and the time left."""

import sys
import time

from nectosome.units import shorten

_LABEL = 200  # characters


class WorkClock:
    """What is being done, and an estimate of the time left.

    The share done grows at the speed since it was first known, so that compiling before that does not count; at first,
    at that since the beginning. A share that falls begins another part.
    """

    def __init__(self, label: str):
        self.label = self.words = shorten(label, _LABEL)  # names come from files
        self.share = 0.0
        self.began = self.known = time.monotonic()  # s, of the work and of the first share
        self.first, self.last = 0.0, self.began

    def update(self, what: str, share: float) -> None:
        """Do `what` from now on, with that share done."""
        now = time.monotonic()
        if share < self.share or (share > 0 and self.share == self.first == 0.0):
            self.known, self.first = now, share
        if share != self.share:
            self.last = now
        self.words = f"{self.label}: {shorten(what, _LABEL)}" if what else self.label
        self.share = min(share, 1.0)

    @property
    def times(self) -> str:
        """Time gone, and time left where it is known."""
        now = time.monotonic()
        gone = clock_text(now - self.began)
        remember = sys.modules.get("nectosome.core.programs.remember")  # not loaded for this: JAX takes a second
        if not 0.0 < self.share < 1.0:
            return f"{gone}, compiling equations" if remember and remember.compiling else gone
        grown = self.share > self.first and self.last > self.known
        since, done = (self.known, self.share - self.first) if grown else (self.began, self.share)
        left = (1.0 - self.share) * (self.last - since) / done - (now - self.last)
        return f"{gone}, about {clock_text(max(left, 0.0))} left"


def clock_text(seconds: float) -> str:
    """A time as minutes and seconds, or with hours."""
    minutes, rest = divmod(round(seconds), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{rest:02d}" if hours else f"{minutes}:{rest:02d}"

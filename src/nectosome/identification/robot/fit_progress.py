"""Progress of a fit by its evaluations, and what they cost."""

from collections.abc import Sequence, Sized
from concurrent.futures import CancelledError

from nectosome.designs.sweep import Progress

from .misfit import DERIVATIVES, READINGS

FORECAST = "an evaluation takes"  # begins the words of what a fit will cost
_LONG = 10.0  # s of processor time: what a fit costs is said where it takes longer
_START, _FIT, _CLOCKS = (8, 3), (20, 5), (12, 4)  # evaluations, and those with derivatives, as fits usually take


class FitProgress:
    """Share done of a fit with so many parameters, whose starts take a share of the recordings."""

    def __init__(self, progress: Progress | None, parameters: int, few: float = 1.0):
        self._progress, self._few = progress, few
        self._dear = 6.0 + parameters  # evaluations that one with derivatives takes
        self._parts, self._starts = list[float](), 0
        self._words, self._part, self._units_done, self._count = "", 0, 0.0, 0

    def begin_starts(self, starts: int, ended: int) -> None:
        """Report that so many starts are to be made, of which some have ended. Raises CancelledError."""
        self._starts = starts
        self._parts = [self._few * self._units(*_START)] * starts + [self._units(*_FIT), self._units(*_CLOCKS)]
        self.begin_next(range(ended))

    def begin_next(self, ended: Sized) -> bool:
        """Report that the next start begins. Raises CancelledError; to go on is True."""
        number = f"start {min(len(ended) + 1, self._starts)} of {self._starts}"
        self.begin(number if self._starts > 1 else "fitting", len(ended))
        return True

    def begin(self, words: str, part: int) -> None:
        """Report that a part begins: a start, by its number, then the fit, the clocks. Raises CancelledError."""
        self._words, self._part, self._units_done = words, part, 0.0
        self.report(words)

    def each(self, what: str, seconds: float) -> None:
        """Report an evaluation."""
        share = self._few if self._part < self._starts else 1.0
        self._units_done += share * (self._dear if what == DERIVATIVES else 1.0)
        self._count += what == READINGS
        self.report(f"{self._words}, evaluation {self._count}")

    def report(self, words: str) -> None:
        """Report what is done and the share. Raises CancelledError where the fit is not to go on."""
        gone, part = sum(self._parts[: self._part]), self._parts[self._part]
        share = (gone + min(self._units_done, part)) / sum(self._parts)
        if self._progress is not None and self._progress(words, share) is False:
            raise CancelledError

    def forecast(self, seconds: float, slow: Sequence[str] = ()) -> None:
        """Say what a fit costs whose evaluation takes so long [s], where that is much, and what makes it slow."""
        total = sum(self._parts) * seconds
        if self._progress is not None and total > _LONG:
            runs, dear = (
                round(self._starts * self._few * a) + b + c for a, b, c in zip(_START, _FIT, _CLOCKS, strict=True)
            )
            each = f"{seconds:.2g} s of processor time, with derivatives about {self._dear * seconds:.2g} s"
            said = f"{FORECAST} {each}; about {runs} and {dear} of them, {total:.2g} s in all"
            self._progress(". ".join([said, *slow]), 0.0)

    def _units(self, runs: int, dear: int) -> float:
        return runs + dear * self._dear

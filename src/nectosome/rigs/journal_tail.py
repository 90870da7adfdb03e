"""The journal of a run that goes on, read as it grows."""

from collections import deque
from pathlib import Path
from typing import Any

from .log import take_line


class JournalTail:
    """The last rows of a journal, `most` of them at most; `units` are those of its columns, by name.

    The journal may not be there yet, and is gone when the run has ended: then nothing more comes.
    """

    def __init__(self, path: Path, most: int):
        self.path = path
        self.units: dict[str, str] = {}
        self.rows: deque[list[float]] = deque(maxlen=most)
        self._attributes: dict[str, Any] = {}
        self._begin = 0  # of what has not been read [bytes]

    def read(self) -> None:
        """Take the lines that have come since; one without its end waits."""
        try:
            with self.path.open("rb") as file:
                file.seek(self._begin)
                text = file.read()
        except OSError:
            return
        whole = text[: text.rfind(b"\n") + 1]
        self._begin += len(whole)
        for line in whole.decode(errors="replace").splitlines():
            take_line(line, self._attributes, self.units, self.rows)

"""The log of an experiment: a text journal while it runs, netCDF at its end; and the journal of a killed run."""

import io
import json
import os
import re
import threading
import time
from array import array
from collections import deque
from collections.abc import Mapping
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.io import save_dataset
from nectosome.io.file_system import is_taken, read_bytes, reason
from nectosome.units import InputError

if TYPE_CHECKING:
    import xarray


_PAUSE = 5e-3  # seconds between writes: at 1 kHz a thread that wakes for each line takes a sixth of the time of samples
_SYNC = 0.25  # seconds between calls of fsync, at most
_PATIENCE = 2.0  # seconds for the disk to take a line
_MOST = 10_000  # lines that wait
_ATTRIBUTE = re.compile(r"# (\w+): (.*)")
_COLUMN = re.compile(r"([^],[]+) \[([^],[]*)\]")


class LogError(Exception):
    """The log can no longer be written."""


class RunLog:
    """One row a sample, in memory and in a journal beside the file that it ends in: `run.csv` and `run.nc`.

    - units: of each column, by its name, in their order; the first one is the time.

    A thread writes lines as they come and calls fsync, which may take a disk many samples. A process that is killed
    loses the lines that wait for it, those of some milliseconds; a loss of power those of the last half second. A full
    disk is an error at the next row, a disk that does not respond after two seconds.

    Raises InputError where the files cannot be written, or exist: measurements are not overwritten.
    """

    def __init__(self, path: str | Path, attributes: Mapping[str, Any], units: Mapping[str, str]):
        self.path = Path(path)
        self.journal = self.path.with_suffix(".csv")
        self.attributes, self.units = dict(attributes), dict(units)
        if self.path.suffix != ".nc":
            raise InputError("a log ends in a netCDF file, as in run.nc.", file=str(path))
        if is_taken(self.path):
            raise InputError("is there already, and what was measured is not overwritten.", file=str(path))
        self._file = self._begun()
        self._rows = array("d")
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._error: OSError | None = None
        self._alive = time.monotonic()  # when the thread last came round
        self._writer = threading.Thread(target=self._work, name="log", daemon=True)
        self._writer.start()

    def _begun(self) -> io.FileIO:
        """The journal, with its head."""
        head = "".join(_attribute(name, value) for name, value in self.attributes.items())
        head += ",".join(f"{name} [{self.units[name]}]" for name in self.units) + "\n"
        try:
            file = self.journal.open("xb", buffering=0)
            try:
                _write(file, head)
            except BaseException:
                file.close()
                self.journal.unlink()
                raise
        except FileExistsError:
            raise InputError(
                "is the journal of a run that was killed. Read it with `recovered`, then move it.",
                file=str(self.journal),
            ) from None
        except OSError as error:
            raise InputError(f"cannot be written: {reason(error)}.", file=str(self.journal)) from None
        return file

    def append(self, *row: float) -> None:
        """Take the numbers of a sample, in the order of the columns. Raises LogError where the disk takes no more."""
        self._rows.extend(row)
        while True:
            self._look()
            if self._lines.qsize() < _MOST:
                break
            time.sleep(1e-3)  # a model runs faster than a disk
        self._lines.put(",".join(map(repr, row)) + "\n")

    def end(self, attributes: Mapping[str, Any]) -> tuple["xarray.Dataset", Path, str]:
        """Return all rows, the file that they are in, and what went wrong with it, or "".

        The journal goes when the netCDF file is there; else it stays, with the attributes as its last lines.
        """
        for name, value in attributes.items():
            self._lines.put(_attribute(name, value))
        self._lines.put(None)
        self._writer.join(5 * _PATIENCE)
        self._file.close()
        data = dataset(
            np.asarray(self._rows).reshape(-1, len(self.units)), self.attributes | dict(attributes), self.units
        )
        try:
            save_dataset(data, self.path)
        except Exception as error:  # whatever it is: the data are there, and must not be lost with it
            return data, self.journal, str(error) or type(error).__name__
        self.journal.unlink(missing_ok=True)
        return data, self.path, ""

    def discard(self) -> None:
        """End without a file: nothing was measured."""
        self._lines.put(None)
        self._writer.join(5 * _PATIENCE)
        self._file.close()
        self.journal.unlink(missing_ok=True)

    def _look(self) -> None:
        if self._error is not None:
            raise LogError(f"{self.journal} cannot be written: {reason(self._error)}.") from self._error
        if not self._lines.empty() and time.monotonic() - self._alive > _PATIENCE:
            raise LogError(f"{self.journal} cannot be written: the disk has taken nothing for {_PATIENCE:g} s.")

    def _work(self) -> None:
        """What the thread does, until there is a None or an error."""
        synced, dirty, ends = time.monotonic(), False, False
        try:
            while not ends:
                lines = self._waiting()
                self._alive = time.monotonic()
                ends = None in lines
                if text := "".join(line for line in lines if line):
                    _write(self._file, text)
                    dirty = True
                if dirty and (ends or self._alive - synced > _SYNC):
                    os.fsync(self._file.fileno())
                    synced, dirty = time.monotonic(), False
        except OSError as error:
            self._error = error

    def _waiting(self) -> list[str | None]:
        """All that waits; nothing where none comes."""
        try:
            lines = [self._lines.get(timeout=_SYNC)]
        except Empty:
            return []
        if lines[0] is not None:
            time.sleep(_PAUSE)
        while not self._lines.empty():
            lines.append(self._lines.get())
        return lines


def dataset(rows: np.ndarray, attributes: Mapping[str, Any], units: Mapping[str, str]) -> "xarray.Dataset":
    """Rows of these columns as labelled data."""
    import xarray

    columns = {
        name: xarray.DataArray(rows[:, k], dims="time", attrs={"units": unit})
        for k, (name, unit) in enumerate(units.items())
    }
    return xarray.Dataset(columns, attrs=dict(attributes)).set_coords("time")


def _attribute(name: str, value: Any) -> str:
    return f"# {name}: {json.dumps(value)}\n"


def _write(file: io.FileIO, text: str) -> None:
    line = text.encode()
    if file.write(line) != len(line):
        raise OSError("the disk is full")


def recovered(journal: str | Path) -> "xarray.Dataset":
    """Return what a journal holds; `status_reason` says where it breaks off, and what was left out.

    Lines after the first that is torn or damaged are left out. Raises InputError for a file that cannot be read or is
    no journal of a run.
    """
    text = read_bytes(journal).decode(errors="replace")
    attributes: dict[str, Any] = {}
    units: dict[str, str] = {}
    rows: list[list[float]] = []
    lines = text.splitlines(keepends=True)
    sound = 0
    for line in lines:
        if not (line.endswith("\n") and take_line(line[:-1], attributes, units, rows)):
            break
        sound += 1
    if not units:
        raise InputError("this is no journal of a run, or its head is damaged.", file=str(journal))
    if "status" not in attributes:
        until = f" at {rows[-1][0]:.3f} s" if rows else " before the first sample"
        lost = f"; {len(lines) - sound} torn or damaged lines were left out" if sound < len(lines) else ""
        why = f"the process was killed, or the power failed: the journal breaks off{until}{lost}."
        attributes |= {"status": "killed", "status_reason": why}
    return dataset(np.array(rows).reshape(-1, len(units)), attributes, units)


def take_line(
    line: str, attributes: dict[str, Any], units: dict[str, str], rows: list[list[float]] | deque[list[float]]
) -> bool:
    """Take in a line of a journal, without its end; say whether it is sound."""
    try:
        if match := _ATTRIBUTE.fullmatch(line):
            attributes[match[1]] = json.loads(match[2])
        elif not units:
            columns = [_COLUMN.fullmatch(text) for text in line.split(",")]
            if not all(columns) or not line.startswith("time [s],"):
                return False
            units |= {column[1]: column[2] for column in columns if column}
        else:
            row = [float(x) for x in line.split(",")]
            if len(row) != len(units):
                return False
            rows.append(row)
    except ValueError:
        return False
    return True


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

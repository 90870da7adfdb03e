"""Reading a file of any format to its end, damaging it, and the memory that this takes."""

import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from hypothesis import strategies as st

from nectosome.measure.formats.source import Options, TableSource
from nectosome.units import InputError

Opener = Callable[[Path, Options], TableSource]


@dataclass(frozen=True)
class Contents:
    names: list[str]
    units: list[str]
    found: tuple[str, ...]
    repairs: list[str]
    rows: np.ndarray
    values: np.ndarray

    def __getitem__(self, name: str) -> np.ndarray:
        return self.values[:, self.names.index(name)]


def read(opener: Opener, path: Path, rows: int = 3, **options) -> Contents:
    """All of a file, read twice: in pieces of a few rows, and in one."""
    with opener(path, Options(**options)) as source:
        pieces, (whole,) = list(source.pieces(rows)), source.pieces(10**9)
        assert all(len(piece.rows) == len(piece.values) <= rows for piece in pieces)
        values = np.concatenate([piece.values for piece in pieces])
        assert values.dtype == float
        assert values.shape[1] == len(source.columns)
        np.testing.assert_array_equal(values, whole.values)
        np.testing.assert_array_equal(np.concatenate([piece.rows for piece in pieces]), whole.rows)
        assert len(set(source.repairs)) == len(source.repairs)
        names, units = [c.name for c in source.columns], [c.unit for c in source.columns]
        return Contents(names, units, source.found, source.repairs, whole.rows, values)


def check_refusals(opener: Opener, folder: Path, files: dict[str, tuple[bytes, str]]) -> None:
    """Files by name with this content are refused with such words; so are a missing one and a folder."""
    for name, (content, message) in files.items():
        (folder / name).write_bytes(content)
        with pytest.raises(InputError, match=f"{name}.*{message}"):
            read(opener, folder / name)
    with pytest.raises(InputError, match="No such file"):
        read(opener, folder / "none")
    with pytest.raises(InputError, match="Is a directory"):
        read(opener, folder)


def survived(opener: Opener, path: Path, raw: bytes) -> Contents | None:
    """What is read of a damaged file; None where an InputError with the name of the file says that it is damaged."""
    path.write_bytes(raw)
    try:
        return read(opener, path, rows=1000)
    except InputError as error:
        assert path.name in str(error)
        return None


def cuts(raw: bytes) -> Iterator[bytes]:
    """A file broken off at a hundred places."""
    return (raw[:end] for end in range(0, len(raw), max(1, len(raw) // 100)))


flips = st.lists(st.tuples(st.floats(0, 1, exclude_max=True), st.integers(0, 255)), min_size=1, max_size=4)
"""Places in a file, and what becomes of the bytes there."""


def flipped(raw: bytes, places: list[tuple[float, int]]) -> bytes:
    damaged = bytearray(raw)
    for place, byte in places:
        damaged[int(place * len(raw))] = byte
    return bytes(damaged)


def growth(opener: Opener, path: Path) -> float:
    """By how much the memory of a process grows while it reads a file in pieces of 100 000 rows [MB].

    Asked of Linux itself: `getrusage` begins with the peak of the process that started this one.
    """
    program = f"""
import re, sys
from pathlib import Path
from nectosome.measure.formats.source import Options
from {opener.__module__} import {opener.__name__} as opener
import h5py, nptdms, nectosome.units.errors
peak = lambda: int(re.search(r"VmHWM:\\s+(\\d+) kB", Path("/proc/self/status").read_text())[1]) / 1024
before, rows = peak(), 0
with opener(Path(sys.argv[1]), Options()) as source:
    for piece in source.pieces(100_000):
        rows += len(piece.rows)
print(peak() - before, rows)
"""
    run = subprocess.run([sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True)
    return float(run.stdout.split()[0])

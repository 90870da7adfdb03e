"""Errors of files before any number is read: missing, empty, of another format, damaged, too large."""

import math
import re
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from nectosome.io.file_system import read_bytes, reason
from nectosome.units import InputError, shorten

_KINDS = {
    b"PK\x03\x04": "a zip file (.xlsx, .npz and .ods are such files)",
    b"\xd0\xcf\x11\xe0": "an old .xls workbook, or one with a password. Save it as .xlsx without a password",
    b"\x89HDF\r\n\x1a\n": "an HDF5 file (.h5, .nc, or .mat of version 7.3)",
    b"CDF": "a netCDF file (.nc)",
    b"MATLAB": "a MAT-file (.mat)",
    b"\x93NUMPY": "a NumPy array (.npy)",
    b"TDSm": "a LabVIEW file (.tdms)",
    b"\x89MCAP0\r\n": "a recording of ROS 2 or Foxglove (.mcap)",
    b"SQLite format 3\0": "a database of SQLite (.db3, if it is a bag of ROS 2)",
    b"TDSh": "the index of a LabVIEW file. Open the .tdms file beside it",
}
_TEXT = {*b"\t\n\r\f", *range(32, 127), *range(128, 256)}
COLUMNS = 5_000  # a few seconds in the slowest format, and more than any rig has
MEMORY = 1_000_000_000  # bytes


def first_bytes(path: Path, size: int = 512) -> bytes:
    """Return the first bytes of a file. Raises InputError if it is missing, a folder, not readable or empty."""
    start = read_bytes(path, size)
    if not start:
        raise InputError("is empty.", file=str(path))
    return start


def is_binary(start: bytes) -> bool:
    """Whether a file that begins with `start` has a known binary format."""
    return b"\0" in start and start.startswith(tuple(_KINDS))


def is_text(start: bytes) -> bool:
    """Whether these bytes can be the beginning of a text in an 8-bit encoding."""
    return _TEXT.issuperset(start)


def wrong_format(path: Path, expected: str, start: bytes) -> InputError:
    """Return the error for a file that begins with `start` and is not `expected`, such as "a LabVIEW file"."""
    kind = next((kind for mark, kind in _KINDS.items() if start.startswith(mark)), "")
    if not kind and is_text(start):
        kind = "a text file. If it holds a table, name it .csv or .txt"
    return InputError(
        f"this is not {expected}{f' but {kind}' if kind else ', or its beginning is damaged'}.", file=str(path)
    )


@contextmanager
def damage_as_input_error(path: Path, where: str = "") -> Iterator[None]:
    """Turn any exception inside into an InputError: libraries raise arbitrary ones for a damaged file."""
    try:
        yield
    except InputError as error:
        if error.file is not None:
            raise
        raise InputError(error.message, file=str(path), line=error.line, field=error.field) from error.__cause__
    except MemoryError as error:
        raise InputError(f"does not fit into memory{where}, or is damaged.", file=str(path)) from error
    except Exception as error:
        system = isinstance(error, OSError) and error.errno
        why = reason(error) if system else "the file is damaged or cut off"
        raise InputError(f"cannot be read{where}: {why}.", file=str(path)) from error


_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([kMG]?B)")
_BYTES = {"B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}


def check_columns(count: int) -> None:
    """Raise InputError for more columns than are read."""
    if count > COLUMNS:
        why = f"has {count} columns, and {COLUMNS} are read at most"
        raise InputError(f"{why}. If its samples run along its rows, transpose it; else save a part of its columns.")


def check_memory(
    sizes: Iterable[float], memory: float, what: str = "it holds when it is unpacked", share: float = 1.0
) -> None:
    """Raise InputError where these sizes [bytes] are more than their share of the `memory` that one file may take."""
    total = sum(sizes)
    if total > share * memory:
        why = f"{show_size(total)} are what {what}, and {show_size(share * memory)} are allowed"
        more = f"{math.ceil(1e-9 * total / share)}GB"
        raise InputError(
            f"{why}. Allow more by measure --memory {more}, if the file can be trusted, or save less of it."
        )


def read_size(text: str, field: str) -> int:
    """Return a size such as `2GB` [bytes]. Raises InputError, which names the field."""
    match = _SIZE.fullmatch(text.strip())
    if match is None or not float(match[1]):
        raise InputError(f'"{shorten(text)}" is no size, as in "500MB" or "2GB".', field=field)
    return round(float(match[1]) * _BYTES[match[2]])


def show_size(size: float) -> str:
    """Write a size [bytes] in a convenient unit."""
    unit = next((name for name in ("GB", "MB", "kB") if size >= _BYTES[name]), "B")
    return f"{size / _BYTES[unit]:.3g} {unit}"

"""NumPy files: one array (.npy), or several named ones (.npz). Nothing is unpickled."""

from pathlib import Path
from typing import IO, Any
from zipfile import ZipFile

import numpy as np

from nectosome.measure.formats.arrays import ArraySource, LazyArray
from nectosome.measure.formats.source import Options, TableSource
from nectosome.measure.formats.tables import NamedArray, SkippedEntry, choose, classify
from nectosome.units import InputError

from .file_errors import COLUMNS, check_memory, damage_as_input_error, first_bytes, wrong_format

ENDINGS = ".npy", ".npz"
BEGINNINGS = (b"\x93NUMPY",)

_OBJECTS = "Python objects, which are not read from files. Save arrays of numbers"


def open_numpy_files(path: Path, options: Options) -> TableSource:
    """Open a .npy file (a vector, a matrix, records) or a .npz file (vectors of equal length, or a matrix).

    Raises InputError for another format, a damaged file, and Python objects.
    """
    start = first_bytes(path)
    if start.startswith(b"\x93NUMPY"):
        with damage_as_input_error(path):
            return _single(path, options)
    if start.startswith(b"PK\x03\x04"):
        with damage_as_input_error(path):
            return _archive(path, options)
    raise wrong_format(path, "a NumPy file", start)


def _single(path: Path, options: Options) -> TableSource:
    if options.table is not None:
        raise InputError(f'a .npy file has one array without a name: leave table="{options.table}" out.')
    with path.open("rb") as file:
        if _header(file)[2].hasobject:
            raise InputError(f"holds {_OBJECTS}.")
    mapped = np.lib.format.open_memmap(path, mode="r")
    # mapped again for each piece, so that read data do not stay in memory
    again = LazyArray(
        mapped.shape, mapped.dtype, lambda rows: np.array(np.lib.format.open_memmap(path, mode="r")[rows])
    )
    table = choose([classify("", again)], None)
    return ArraySource("numpy", path, table.blocks(), table.found, left_out=table.left_out)


def _archive(path: Path, options: Options) -> TableSource:
    entries: list[NamedArray | SkippedEntry] = []
    with ZipFile(path) as archive:
        check_memory((member.file_size for member in archive.infolist()), options.memory)
        if (n := len(archive.infolist())) > COLUMNS:
            raise InputError(f"has {n} arrays, and {COLUMNS} are read at most. Save a part of them.")
        members = [name for name in archive.namelist() if name.endswith(".npy")]
        if not members:
            raise wrong_format(path, "a NumPy file", first_bytes(path))
        for member in members:
            name = member.removesuffix(".npy")
            with archive.open(member) as file:
                shape, _, dtype = _header(file)
                if dtype.hasobject:
                    entries.append(SkippedEntry(name, _OBJECTS, rows=shape[0] if len(shape) == 1 else 0))
                    continue
            with archive.open(member) as file:
                entries.append(classify(name, np.lib.format.read_array(file, allow_pickle=False)))
    table = choose(entries, options.table)
    return ArraySource("numpy", path, table.blocks(), table.found, left_out=table.left_out)


def _header(file: IO[bytes]) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    """Shape, order and type of an array."""
    version = np.lib.format.read_magic(file)
    read = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    return read(file)

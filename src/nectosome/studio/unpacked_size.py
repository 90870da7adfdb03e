"""How large a file becomes when it is unpacked: formats that compress can hide gigabytes in a few kilobytes."""

import struct
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any, BinaryIO

import h5py

from nectosome.units import InputError

UNPACKED_LIMIT = 1024 * 1024 * 1024  # [bytes]
_MAT_HEAD, _MAT_COMPRESSED = 128, 15  # [bytes] before the elements of a MATLAB file of version 5; a kind of them
_PIECE = 1024 * 1024  # [bytes] that are unpacked at a time


def check_unpacked(path: Path) -> None:
    """Raise InputError where what is in a file is larger than `UNPACKED_LIMIT`; damaged ones are left to their readers.

    HDF5 (netCDF, MATLAB 7.3) and ZIP (Excel, .npz) say how large they are, which holds for reading them too; what
    MATLAB 5 has compressed is unpacked piece by piece, and kept nowhere.
    """
    with path.open("rb") as file:
        head = file.read(_MAT_HEAD)
    sizes = (
        _hdf5(path)
        if head.startswith(b"\x89HDF")
        else _zip(path)
        if head.startswith(b"PK")
        else _matlab(path, head)
        if head.startswith(b"MATLAB 5")
        else iter(())
    )
    total = 0
    with suppress(OSError, zipfile.BadZipFile, zlib.error, struct.error, RuntimeError):
        for size in sizes:
            total += size
            if total > UNPACKED_LIMIT:
                break
    if total > UNPACKED_LIMIT:
        raise InputError(
            f"holds more than {UNPACKED_LIMIT / 2**30:.0f} GiB when it is unpacked: too much for the page.",
            file=path.name,
        )


def _hdf5(path: Path) -> Iterator[int]:
    found: list[int] = []

    def add(_: str, node: Any) -> None:
        if isinstance(node, h5py.Dataset):
            found.append((node.size or 0) * node.dtype.itemsize)

    with h5py.File(path) as file:
        file.visititems(add)
    yield from found


def _zip(path: Path) -> Iterator[int]:
    with zipfile.ZipFile(path) as file:
        yield from (item.file_size for item in file.infolist())


def _matlab(path: Path, head: bytes) -> Iterator[int]:
    order = ">" if head[126:128] == b"MI" else "<"
    with path.open("rb") as file:
        file.seek(_MAT_HEAD)
        while tag := file.read(8):
            kind, size = struct.unpack(order + "II", tag)
            if kind == _MAT_COMPRESSED:
                yield from _inflated(file, size)
            else:
                file.seek(size, 1)


def _inflated(file: BinaryIO, size: int) -> Iterator[int]:
    stream, left = zlib.decompressobj(), size
    while left > 0 and (packed := file.read(min(left, _PIECE))):
        left -= len(packed)
        while packed:
            yield len(stream.decompress(packed, _PIECE))
            packed = stream.unconsumed_tail

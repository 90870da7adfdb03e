"""Damage of an HDF5 file that its library would read for ever."""

import mmap
import re
from pathlib import Path

from nectosome.units import InputError

_HEAP = re.compile(rb"GCOL\x01\0\0\0")
_HEAD = 16  # bytes, of a heap and of each object in it: of the latter 2 are its index, the last 8 its size


def check_heaps(path: str | Path) -> None:
    """Raise InputError where a global heap of an HDF5 file has a free space of no bytes: HDF5 2.0 stays there.

    Objects follow each other, each of 16 bytes and its size, rounded up to 8; free space is object 0, whose size counts
    these 16 bytes too, and is the last (HDF5 file format 3.0, III.E). Raises OSError where the file cannot be read.
    """
    with Path(path).open("rb") as file:
        if not file.seek(0, 2):
            return
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as raw:
            for heap in _HEAP.finditer(raw):
                if _is_endless(raw, heap.start()):
                    raise InputError("cannot be read: it is damaged.", file=str(path))


def _is_endless(raw: mmap.mmap, start: int) -> bool:
    end = min(start + _number(raw, start + 8, 8), len(raw))
    at = start + _HEAD
    while at + _HEAD <= end:
        index, size = _number(raw, at, 2), _number(raw, at + 8, 8)
        if index == 0:
            return size == 0
        at += _HEAD + (size + 7) // 8 * 8
    return False


def _number(raw: mmap.mmap, at: int, length: int) -> int:
    return int.from_bytes(raw[at : at + length], "little")

"""Damage of an HDF5 file that its library would read for ever."""

import mmap
import re
from pathlib import Path

from nectosome.units import InputError

_HEAP = re.compile(rb"GCOL\x01\0\0\0")
_WINDOW = 2**24  # bytes that are searched at once, a multiple of every system's granularity of maps
_HEAD = 16  # bytes, of a heap and of each object in it: of the latter 2 are its index, the last 8 its size


def check_heaps(path: str | Path) -> None:
    """Raise InputError where a global heap of an HDF5 file has a free space of no bytes: HDF5 2.0 stays there.

    Objects follow each other, each of 16 bytes and its size, rounded up to 8; free space is object 0, whose size counts
    these 16 bytes too, and is the last (HDF5 file format 3.0, III.E). Raises OSError where the file cannot be read.
    """
    with Path(path).open("rb") as file:
        if not file.seek(0, 2):
            return
        size = file.tell()
        with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as raw:
            for start in range(0, size, _WINDOW):
                length = min(_WINDOW + _HEAD, size - start)  # a heap may begin in one window and go on in the next
                # a map of its own for each window: its pages leave the memory with it
                with mmap.mmap(file.fileno(), length, access=mmap.ACCESS_READ, offset=start) as window:
                    heaps = [start + heap.start() for heap in _HEAP.finditer(window)]
                if any(_is_endless(raw, heap) for heap in heaps):
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

"""Memory of this process: how much it has, and how to give back what it does not need."""

import ctypes
import gc
import mmap
from contextlib import suppress
from pathlib import Path


def resident() -> int:
    """Memory of this process [bytes]; 0 where the system does not tell."""
    try:
        return int(Path("/proc/self/statm").read_text().split()[1]) * mmap.PAGESIZE
    except OSError:
        return 0


def give_back() -> None:
    """Give memory that nothing needs any more back to the system; the C library of GNU keeps it otherwise."""
    gc.collect()
    with suppress(OSError, AttributeError):
        ctypes.CDLL("libc.so.6").malloc_trim(0)

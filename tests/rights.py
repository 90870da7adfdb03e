"""The rights of an ordinary user, also where tests run as root, who may enter every folder."""

import ctypes
import sys
from collections.abc import Iterator
from contextlib import contextmanager

_DAC = 1 << 1 | 1 << 2  # CAP_DAC_OVERRIDE and CAP_DAC_READ_SEARCH
_VERSION = 0x20080522  # of linux/capability.h, 64 bits in two words


@contextmanager
def ordinary_rights() -> Iterator[None]:
    """Within it this thread has the rights that the modes of files give it; that of root is put down (Linux)."""
    if not sys.platform.startswith("linux"):
        yield
        return
    libc = ctypes.CDLL(None, use_errno=True)
    head, words = (ctypes.c_uint32 * 2)(_VERSION, 0), (ctypes.c_uint32 * 6)()
    assert libc.capget(head, words) == 0
    before = words[0]  # the effective ones; those that are permitted stay, so that they can be taken up again
    words[0] = before & ~_DAC
    assert libc.capset(head, words) == 0
    try:
        yield
    finally:
        words[0] = before
        assert libc.capset(head, words) == 0

"""Locks on open files, released by the system when their process ends, however it ends."""

import time
from typing import IO


def lock(file: IO, wait: float = 0.0) -> bool:
    """Take the lock on an open file, trying for `wait` seconds; say whether it is ours.

    Where the system has no such locks (Windows), every file counts as ours.
    """
    try:
        import fcntl
    except ImportError:
        return True
    until = time.monotonic() + wait
    while True:
        try:
            fcntl.flock(file.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            if time.monotonic() >= until:
                return False
            time.sleep(0.02)
        else:
            return True

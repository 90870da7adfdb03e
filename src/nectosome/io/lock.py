"""Locks on open files, released by the system at the end of the process."""

import time
from typing import IO


def lock(file: IO, wait: float = 0.0) -> bool:
    """Try to lock an open file for `wait` [s]; return whether it is locked by this process.

    Systems without such locks (Windows) always return True.
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

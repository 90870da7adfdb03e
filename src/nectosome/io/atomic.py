"""Atomic writing of files, and locks on open files."""

import os
import secrets
import time
from collections.abc import Callable
from pathlib import Path
from typing import IO

from nectosome.io.file_system import exists, is_file, is_folder, make_folder, reason
from nectosome.units import InputError


def write_atomic(path: str | Path, content: bytes | Callable[[Path], object]) -> None:
    """Write `content` to a temporary file, then rename it to `path`, so that `path` is never incomplete.

    A callable gets the path to write to. After an error an existing file is unchanged and no temporary file remains.
    Raises InputError if the disk, the permissions or the path do not allow it.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}") if path.name else path
    try:
        if not path.name or is_folder(path):
            raise InputError(f"cannot write {path}: it is a folder.")
        if exists(path) and not is_file(path):
            raise InputError(f"cannot write {path}: it is not a file.")
        try:
            if callable(content):
                content(temporary)
            else:
                temporary.write_bytes(content)
            with temporary.open("rb+") as file:
                os.fsync(file.fileno())
            temporary.replace(path)
        finally:
            temporary.unlink(missing_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write {path}: {reason(error)}.") from error


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


def own_folder(folder: Path) -> IO[str]:
    """Make a folder this process's own until the file that is returned, `lock` in it, is closed.

    Raises InputError where it cannot be written, and where another process has it, with its number.
    """
    make_folder(folder)
    try:
        file = (folder / "lock").open("a+")
        if lock(file):
            file.truncate(0)
            file.write(str(os.getpid()))
            file.flush()
            return file
        file.seek(0)
        holder = file.read().strip()
        file.close()
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be used: {reason(error)}.", file=str(folder)) from None
    raise InputError(f"is in use by process {holder}.", file=str(folder))

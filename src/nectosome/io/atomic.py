"""Atomic writing of files."""

import os
import secrets
from collections.abc import Callable
from pathlib import Path

from nectosome.units import InputError


def write_atomic(path: str | Path, content: bytes | Callable[[Path], object]) -> None:
    """Write `content` to a temporary file, then rename it to `path`, so that `path` is never incomplete.

    A callable gets the path to write to. After an error an existing file is unchanged and no temporary file remains.
    Raises InputError if the disk, the permissions or the path do not allow it.
    """
    path = Path(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}") if path.name else path
    try:
        if not path.name or path.is_dir():
            raise InputError(f"cannot write {path}: it is a folder.")
        if path.exists() and not path.is_file():
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


def reason(error: Exception) -> str:
    """Return the reason of a read or write error in a few words."""
    words = getattr(error, "strerror", None) or str(error).partition("\n")[0] or "it failed"
    return str(words).rstrip(".")

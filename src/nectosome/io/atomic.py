"""Files that are there whole or not at all."""

import os
import secrets
from collections.abc import Callable
from pathlib import Path

from nectosome.units import InputError


def write_atomic(path: str | Path, content: bytes | Callable[[Path], object]) -> None:
    """Write `content` to `path`: beside it first, then renamed, so that no half-written file is ever seen.

    A callable gets the path to write to. If anything goes wrong, the file that was there before stays and nothing
    else is left behind. Raises InputError where the disk, the rights or the path do not allow it.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}") if path.name else path
    try:
        if not path.name or path.is_dir():
            raise InputError(f"cannot write {path}: it is a folder.")
        if path.exists() and not path.is_file():
            raise InputError(f"cannot write {path}: it is not a file.")
        try:
            if callable(content):
                content(beside)
            else:
                beside.write_bytes(content)
            with beside.open("rb+") as file:
                os.fsync(file.fileno())
            beside.replace(path)
        finally:
            beside.unlink(missing_ok=True)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot write {path}: {reason(error)}.") from error


def reason(error: Exception) -> str:
    """Return why a file could not be read or written, in a few words."""
    words = getattr(error, "strerror", None) or str(error).partition("\n")[0] or "it failed"
    return str(words).rstrip(".")

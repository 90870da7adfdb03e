"""Files of the user's cache: each with a checksum, whole or not at all, in a folder of the user's own."""

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from nectosome.units import InputError

from .atomic import write_atomic
from .file_system import make_folder

_DIGEST = hashlib.sha256().digest_size


def cache_folder() -> Path | None:
    """Folder of the cache: that of `NECTOSOME_CACHE`, else the user's; None where the variable is empty."""
    from platformdirs import user_cache_dir

    folder = os.environ.get("NECTOSOME_CACHE", user_cache_dir("nectosome"))
    return Path(folder) if folder else None


def read_kept(file: Path) -> bytes | None:
    """Return what `write_kept` wrote; None where it is missing or damaged."""
    try:
        raw = file.read_bytes()
    except OSError:
        return None
    content = raw[_DIGEST:]
    return content if hashlib.sha256(content).digest() == raw[:_DIGEST] else None


def write_kept(file: Path, content: bytes) -> None:
    """Write a file of the cache, over one that is there. A cache that is full, read-only or a file is no error."""
    with suppress(InputError):
        make_kept_folder(file.parent)
        write_atomic(file, hashlib.sha256(content).digest() + content)


def make_kept_folder(folder: Path) -> None:
    """Make a folder of kept files, and the cache that it lies in, for this user only. Raises InputError."""
    for one in (folder.parent, folder):
        make_folder(one, mode=0o700)

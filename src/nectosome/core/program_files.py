"""Files of traced and compiled programs: each with a checksum, whole or not at all, in a folder of the user's own.

What is in them runs with the user's rights, so that a folder into which others can write is not used. JAX's own cache
keeps files as they are: a flipped bit would be machine code, and a damaged file would stay for ever.
"""

import hashlib
import os
from contextlib import suppress
from pathlib import Path

from jax._src import compilation_cache  # no public name takes the place of its files
from jax._src.compilation_cache_interface import CacheInterface

from nectosome.io.atomic import write_atomic
from nectosome.io.file_system import make_folder
from nectosome.units import InputError

_DIGEST = hashlib.sha256().digest_size
_OTHERS = 0o022  # mode bits of a folder into which its group or others can write


def read_program(file: Path) -> bytes | None:
    """Return what `write_program` wrote; None where it is missing or damaged."""
    try:
        raw = file.read_bytes()
    except OSError:
        return None
    content = raw[_DIGEST:]
    return content if hashlib.sha256(content).digest() == raw[:_DIGEST] else None


def write_program(file: Path, content: bytes) -> None:
    """Write a program, over one that is there. A cache that is full, read-only or a file is no error."""
    with suppress(InputError):
        make_program_folder(file.parent)
        write_atomic(file, hashlib.sha256(content).digest() + content)


def make_program_folder(folder: Path) -> None:
    """Make a folder of programs, and the cache that it lies in, for this user only. Raises InputError."""
    for one in (folder.parent, folder):
        make_folder(one, mode=0o700)


def why_refused(cache: Path) -> str:
    """Say why programs in a cache are not to be run, or "": it belongs to another user, or others can write to it."""
    for folder in (cache, cache / "xla", cache / "traced"):
        with suppress(OSError):
            found = folder.stat()
            if hasattr(os, "getuid") and found.st_uid not in (os.getuid(), 0):
                return f"{folder} belongs to another user"
            if os.name == "posix" and found.st_mode & _OTHERS:
                return f"others can write to {folder} (chmod go-w {folder} stops that)"
    return ""


class CompiledPrograms(CacheInterface):
    """What JAX compiles, by its keys, in a folder."""

    def __init__(self, folder: str):
        self._path = Path(folder)

    def get(self, key: str) -> bytes | None:  # pyright: ignore[reportIncompatibleMethodOverride]  JAX's own says None
        """Return a program; None where it is missing or damaged, so that it is made anew."""
        return read_program(self._path / key)

    def put(self, key: str, value: bytes) -> None:
        """Keep a program."""
        write_program(self._path / key, value)


def take_over() -> None:
    """Let JAX keep its programs as `CompiledPrograms`."""
    compilation_cache.get_file_cache = lambda path: (CompiledPrograms(path), path)

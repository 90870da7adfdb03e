"""Files of traced and compiled programs: each with a checksum, whole or not at all, in a folder of the user's own.

What is in them runs with the user's rights, so that a folder into which others can write is not used. JAX's own cache
keeps files as they are: a flipped bit would be machine code, and a damaged file would stay for ever.
"""

import os
from contextlib import suppress
from pathlib import Path

from jax._src import compilation_cache  # no public name takes the place of its files
from jax._src.compilation_cache_interface import CacheInterface

from nectosome.io.atomic import read_kept, write_kept

_OTHERS = 0o022  # mode bits of a folder into which its group or others can write


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
        return read_kept(self._path / key)

    def put(self, key: str, value: bytes) -> None:
        """Keep a program."""
        write_kept(self._path / key, value)


def take_over() -> None:
    """Let JAX keep its programs as `CompiledPrograms`."""
    compilation_cache.get_file_cache = lambda path: (CompiledPrograms(path), path)

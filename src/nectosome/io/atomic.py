"""Files that are whole or not at all: atomic writing, files of the user's cache with checksums; locks on open files."""

import hashlib
import os
import secrets
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import IO

from nectosome.io.file_system import entries, exists, is_file, is_folder, make_folder, reason
from nectosome.units import InputError

_DIGEST = hashlib.sha256().digest_size


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


class OwnFolder:
    """A folder that is this process's own until it is closed, by the file `lock` in it.

    A folder that is made for it goes again when it is closed with nothing else in it. Raises InputError where it cannot
    be written, and where another process has it, with its number.
    """

    def __init__(self, folder: Path):
        self._made = [one for one in (folder, *folder.parents) if not exists(one)]
        make_folder(folder)
        self._lock = folder / "lock"
        try:
            self._file = self._lock.open("a+")
            if lock(self._file):
                self._file.truncate(0)
                self._file.write(str(os.getpid()))
                self._file.flush()
                return
            self._file.seek(0)
            holder = self._file.read().strip()
            self._file.close()
        except (OSError, ValueError) as error:
            raise InputError(f"cannot be used: {reason(error)}.", file=str(folder)) from None
        raise InputError(f"is in use by process {holder}.", file=str(folder))

    def close(self) -> None:
        """Let others have the folder."""
        if self._made and entries(self._lock.parent) == [self._lock]:
            with suppress(OSError):  # a folder above it may hold something else by now
                self._lock.unlink()
                for folder in self._made:
                    folder.rmdir()
        self._file.close()

    def __enter__(self) -> "OwnFolder":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


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

"""What is there: questions to the file system, with an answer for every path.

Those of pathlib raise an error for a folder that may not be entered, and for a name that is too long.
"""

import os
from contextlib import suppress
from pathlib import Path

from nectosome.units import InputError


def reason(error: Exception) -> str:
    """Return the reason of a read or write error in a few words."""
    words = getattr(error, "strerror", None) or str(error).partition("\n")[0] or "it failed"
    return str(words).rstrip(".")


def exists(path: str | Path) -> bool:
    """Whether something is known to be there; not a link that leads nowhere."""
    return os.path.exists(path)  # noqa: PTH110


def is_taken(path: str | Path) -> bool:
    """Whether the name is known to be in use, by a link that leads nowhere too."""
    return os.path.lexists(path)


def is_file(path: str | Path) -> bool:
    """Whether an ordinary file, or a link to one, is known to be there."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: str | Path) -> bool:
    """Whether a folder, or a link to one, is known to be there."""
    return os.path.isdir(path)  # noqa: PTH112


def entries(folder: str | Path, pattern: str = "*") -> list[Path]:
    """Files and folders whose paths below a folder fit a pattern, in order; none where it may not be read."""
    try:
        return sorted(Path(folder).glob(pattern))
    except (OSError, ValueError):  # a name that is too long; a pattern that is none
        return []


def read_bytes(path: str | Path, most: int = -1, source: str | None = None) -> bytes:
    """Return the first `most` bytes of a file, or all. Raises InputError, which calls it `source`, if it cannot."""
    try:
        with Path(path).open("rb") as file:
            return file.read(most)
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=source or str(path)) from None


def check_readable(folder: str | Path) -> None:
    """Raise InputError where a folder is not there, or may not be listed and entered."""
    try:
        os.scandir(f"{folder}/.").close()  # looking for the dot in it is to enter it
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be used as a working folder: {reason(error)}.", file=str(folder)) from None


def make_folder(folder: str | Path, option: str | None = None, *, parents: bool = True, mode: int = 0o777) -> None:
    """Make a folder, and those that it lies in, unless it is there. Raises InputError, and makes none, if it cannot."""
    new = [one for one in (Path(folder), *Path(folder).parents) if not is_taken(one)]
    try:
        Path(folder).mkdir(mode, parents=parents, exist_ok=True)
    except (OSError, ValueError) as error:
        for one in new:
            with suppress(OSError, ValueError):
                one.rmdir()
        raise InputError(f"cannot make the folder {folder}: {reason(error)}.", field=option) from None

"""What is there: questions to the file system, with an answer for every path.

Those of pathlib raise an error for a folder that may not be entered, and for a name that is too long.
"""

import os
from pathlib import Path

from nectosome.io.atomic import reason
from nectosome.units import InputError


def exists(path: str | Path) -> bool:
    """Whether a file, a folder or a link is there, also a link that leads nowhere."""
    return os.path.lexists(path)


def is_file(path: str | Path) -> bool:
    """Whether an ordinary file, or a link to one, is there and known to be."""
    return os.path.isfile(path)  # noqa: PTH113


def is_folder(path: str | Path) -> bool:
    """Whether a folder, or a link to one, is there and known to be."""
    return os.path.isdir(path)  # noqa: PTH112


def entries(folder: str | Path, pattern: str = "*") -> list[Path]:
    """Files and folders in a folder whose paths fit a pattern, in order of their names.

    Raises InputError where the folder is not there or may not be read.
    """
    folder = Path(folder)
    try:
        next(os.scandir(folder), None)  # a pattern finds nothing in a folder that may not be read, and says nothing
        return sorted(folder.glob(pattern))
    except (OSError, ValueError) as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=str(folder)) from None

"""The working folder as the studio's page sees it: names go in, paths within the folder come out.

What a page sends is a name, never a path, and is checked before the disk is read. Links are resolved and have to end
within the folder. That holds when a page asks: who can change the folder itself can put a link there later, and
needs no page for it. Files are written by `write_atomic`, whose renaming follows no link.
"""

import os
import stat
from contextlib import suppress
from itertools import islice
from pathlib import Path

from nectosome.io.file_system import check_readable, is_folder, reason
from nectosome.units import InputError, shorten

NOTHING = "nothing there yet"  # in place of a list of files
_LONGEST = 100  # [characters] of a name
_LISTED = 300  # names in a list
_LOOKED_AT = 10_000  # entries, so that a huge folder takes no longer

_PORTS = {f"{kind}{number}" for kind in ("COM", "LPT") for number in "0123456789¹²³"}
_DEVICES = {"CON", "PRN", "AUX", "NUL", "CONIN$", "CONOUT$"} | _PORTS  # under Windows, with any suffix


class WorkFolder:
    """A folder and what is in it, for people who must not get out of it.

    A name is relative and has `/` between its parts: `fish.yaml`, `runs/fish.nc`.
    Raises InputError where `root` is no folder.
    """

    def __init__(self, root: str | Path):
        try:
            self.root = Path(root).resolve(strict=True)
            check_readable(self.root)
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError(f"cannot be used as a working folder: {reason(error)}.", file=str(root)) from None

    def names(self, *suffixes: str) -> list[str]:
        """Return the names of files here and in the folders here, sorted, at most 300; only those `existing` accepts.

        `suffixes`, as in ".yaml", choose among them, in any case of letters; without them all are listed.
        """
        endings = tuple(suffix.lower() for suffix in suffixes)
        names = _entries(self.root)
        for folder in tuple(names):
            if len(names) >= _LOOKED_AT:
                break
            with suppress(InputError):  # a link that leads out, a name that is none
                names += [f"{folder}/{name}" for name in _entries(self._within(folder))]
        chosen = (name for name in sorted(names) if not endings or name.lower().endswith(endings))
        return list(islice(filter(self._is_file, chosen), _LISTED))

    def choices(self, *suffixes: str) -> list[str]:
        """Return the names that can be chosen among, or `NOTHING`."""
        return self.names(*suffixes) or [NOTHING]

    def name(self, path: Path) -> str:
        """Return what a file of the folder is called, such as `runs/fish.nc`."""
        return path.relative_to(self.root).as_posix()

    def existing(self, name: str) -> Path:
        """Return the path, free of links, of the file called `name`.

        Raises InputError for a name that is none, and where there is no file, or one that is elsewhere, or a folder,
        a pipe, a device. Nothing is opened.
        """
        path = self._within(name)
        _must_be_file(path, name)
        return path

    def listed(self, path: Path) -> Path:
        """Return the path, free of links, of a file that another file of the folder names.

        Raises InputError where it is elsewhere, or no plain file.
        """
        real = Path(os.path.realpath(path))  # a circle of links stays one, and is refused below
        if not real.is_relative_to(self.root):
            raise InputError("is a link that leads out of the working folder.", file=path.name)
        _must_be_file(real, path.name)
        return real

    def target(self, name: str, suffix: str) -> Path:
        """Return the path where to write what is to be called `name`; `suffix` is put behind it where it is missing.

        Its folder must be there. Raises InputError as `existing` does, for any link, and for a file that is there
        already.
        """
        if not name.lower().endswith(suffix.lower()):
            name += suffix
        *folders, last = _parts(name)
        folder = self._within("/".join(folders)) if folders else self.root
        if not is_folder(folder):
            raise InputError(f'"{"/".join(folders)}" is not a folder.')
        path = folder / last
        if os.path.lexists(path):
            _must_be_file(path, name)
            raise InputError(f'"{name}" is there already. Choose another name.')
        return path

    def _within(self, name: str) -> Path:
        """Return the path of what is called `name`, whatever it is, once all links are followed."""
        try:
            path = self.root.joinpath(*_parts(name)).resolve(strict=True)
        except OSError as error:
            raise InputError(f'"{name}" cannot be opened: {reason(error)}.') from None
        except RuntimeError:  # what Python says before 3.13; its text has the path
            raise InputError(f'"{name}" cannot be opened: it is a link in a circle.') from None
        if not path.is_relative_to(self.root):
            raise InputError(f'"{name}" is a link that leads out of the working folder.')
        return path

    def _is_file(self, name: str) -> bool:
        try:
            self.existing(name)
        except InputError:
            return False
        return True


def _parts(name: str) -> list[str]:
    """Return the parts of a name; each is a single part on any platform. Raises InputError."""
    parts = name.split("/")
    if not name or len(name) > _LONGEST:
        why = f"it has {len(name)} characters, 1 to {_LONGEST} are allowed"
    elif not name.isprintable() or "\\" in name or ":" in name:
        why = "only what can be printed is allowed, without \\ and :"
    elif "" in parts or ".." in parts or any(part.startswith(".") for part in parts):
        why = "it has to lie within the working folder, and not be hidden: no / at its ends, no part begins with a dot"
    elif any(part != part.rstrip(". ") or part != part.lstrip() for part in parts):
        why = "no part may begin or end with a space, or end with a dot"
    elif any(map(is_device, parts)):
        why = "it is the name of a device under Windows"
    else:
        return parts
    raise InputError(f'"{shorten(name)}" cannot be used as a file name: {why}.')


def is_device(part: str) -> bool:
    """Whether a name is that of a device under Windows."""
    return part.partition(".")[0].rstrip().upper() in _DEVICES


def _must_be_file(path: Path, name: str) -> None:
    """Raise InputError unless a plain file is at `path` itself; a link at its end is not followed."""
    try:
        mode = path.lstat().st_mode
    except OSError as error:
        raise InputError(f'"{name}" cannot be opened: {reason(error)}.') from None
    if not stat.S_ISREG(mode):
        what = "a folder" if stat.S_ISDIR(mode) else "a link" if stat.S_ISLNK(mode) else "a pipe or a device"
        raise InputError(f'"{name}" is {what}. A file is needed.')


def _entries(folder: Path) -> list[str]:
    """Return the names in a folder that are not hidden; none where it is no folder or may not be read."""
    try:
        with os.scandir(folder) as entries:
            return [entry.name for entry in islice(entries, _LOOKED_AT) if not entry.name.startswith(".")]
    except OSError:
        return []

"""The working folder as the studio's page sees it: names go in, paths within the folder come out.

What a page sends is a name, never a path, and is checked before the disk is read. Links are resolved and have to end
within the folder. That holds when a page asks: who can change the folder itself can put a link there later, and
needs no page for it. Files are written by `write_atomic`, whose renaming follows no link.
"""

import os
import re
import stat
import tempfile
import unicodedata
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from itertools import islice
from pathlib import Path, PurePosixPath

from nectosome.io.atomic import reason
from nectosome.units import InputError, shorten

from .unpacked_size import check_unpacked

UPLOAD_LIMIT = 64 * 1024 * 1024  # [bytes] of a file that a page sends, and of all that are on their way at once
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
        except (OSError, RuntimeError, ValueError) as error:
            raise InputError(f"cannot be used as a working folder: {reason(error)}.", file=str(root)) from None
        if not self.root.is_dir():
            raise InputError("cannot be used as a working folder: it is not a folder.", file=str(root))

    def names(self, *suffixes: str) -> list[str]:
        """Return the names of files here and in the folders here, sorted, at most 300; only those `existing` accepts.

        `suffixes`, as in ".yaml", choose among them, in any case of letters; without them all are listed.
        """
        endings = tuple(suffix.lower() for suffix in suffixes)
        found = _entries(self.root)
        for folder in tuple(found):
            if len(found) >= _LOOKED_AT:
                break
            with suppress(InputError):  # a link that leads out, a name that is none
                found += [f"{folder}/{name}" for name in _entries(self._within(folder))]
        chosen = (name for name in sorted(found) if not endings or name.lower().endswith(endings))
        return list(islice(filter(self._is_file, chosen), _LISTED))

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
        found = path.resolve()
        if not found.is_relative_to(self.root):
            raise InputError("is a link that leads out of the working folder.", file=path.name)
        _must_be_file(found, path.name)
        return found

    def target(self, name: str, suffix: str, *, overwrite: bool = False) -> Path:
        """Return the path where to write what is to be called `name`; `suffix` is put behind it where it is missing.

        Its folder must be there. Raises InputError as `existing` does, for any link, and for a file that is there
        already unless `overwrite`.
        """
        if not name.lower().endswith(suffix.lower()):
            name += suffix
        *folders, last = _parts(name)
        folder = self._within("/".join(folders)) if folders else self.root
        if not folder.is_dir():
            raise InputError(f'"{"/".join(folders)}" is not a folder.')
        path = folder / last
        if os.path.lexists(path):
            _must_be_file(path, name)
            if not overwrite:
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


@contextmanager
def received(name: str, content: bytes) -> Iterator[Path]:
    """Keep a file that a page sent, for as long as it is read, in a temporary folder of its own; yields its path.

    It goes by a harmless form of its own name, so that messages name it and readers see its suffix. It cannot be
    executed. Raises InputError where it is larger than `UPLOAD_LIMIT`, or becomes too large when it is unpacked.
    """
    if len(content) > UPLOAD_LIMIT:
        raise InputError(too_large(name, len(content)))
    with tempfile.TemporaryDirectory(prefix="nectosome-", ignore_cleanup_errors=True) as folder:
        path = Path(folder) / harmless(name)
        path.write_bytes(content)
        check_unpacked(path)
        yield path


def too_large(name: str, size: int) -> str:
    """Return what to say of a file of `size` bytes that is not accepted."""
    return (
        f'"{shorten(name)}" has {size / 2**20:.1f} MiB; at most {UPLOAD_LIMIT / 2**20:.0f} MiB are accepted at a time.'
    )


def harmless(name: str) -> str:
    """Return a file name that is good everywhere and as near to `name` as can be; what `name` has of folders is cut."""
    last = unicodedata.normalize("NFC", re.split(r"[/\\:]", name)[-1])
    plain = PurePosixPath("".join(c if c.isalnum() or c in "._- " else "_" for c in last).strip(". "))
    short = (plain.stem[:40] + plain.suffix[:12]).strip(". ")  # 4 bytes each at most, where 255 are allowed
    return f"_{short}" if not short or _is_device(short) else short


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
    elif any(map(_is_device, parts)):
        why = "it is the name of a device under Windows"
    else:
        return parts
    raise InputError(f'"{shorten(name)}" cannot be used as a file name: {why}.')


def _is_device(part: str) -> bool:
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

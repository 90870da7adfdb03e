"""The working folder as the page sees it: names of files in it, and nothing outside of it."""

import os
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from nectosome.io import InputError

_DEPTH = 2  # folders deep
_MOST = 300  # names
_LONGEST = 100  # characters of a name
_RESERVED = {"CON", "PRN", "AUX", "NUL", *(f"{kind}{n}" for kind in ("COM", "LPT") for n in range(1, 10))}


class Folder:
    """A folder in which a page may open and save files."""

    def __init__(self, root: Path):
        self.root = root.resolve()

    def names(self, *suffixes: str) -> list[str]:
        """Names of the files in it that end so, sorted: none that is hidden, and none that leads out."""
        found = []
        for here, folders, files in os.walk(self.root):  # which follows no links
            depth = len(Path(here).relative_to(self.root).parts)
            folders[:] = sorted(f for f in folders if not f.startswith(".") and depth < _DEPTH)
            for file in sorted(files):
                name = (Path(here) / file).relative_to(self.root).as_posix()
                if file.endswith(suffixes) and self._fine(name):
                    found.append(name)
                if len(found) == _MOST:
                    return found
        return sorted(found)

    def existing(self, name: str) -> Path:
        """Path of a file that is there. Raises InputError for what is none, or is not inside."""
        path = self._inside(name)
        try:
            kind = path.stat().st_mode
        except OSError:
            raise InputError("there is no such file in the working folder.", field=_shown(name)) from None
        if not stat.S_ISREG(kind):
            raise InputError("is no plain file.", field=_shown(name))
        return path

    def target(self, name: str, suffix: str) -> Path:
        """Path to write a new file to, with the suffix. Raises InputError where it is there already, or not inside."""
        path = self._inside(name if name.endswith(suffix) else f"{name}{suffix}")
        if not path.parent.is_dir():
            raise InputError("its folder is not there.", field=_shown(name))
        if path.exists() or path.is_symlink():
            raise InputError("is there already, and is left as it is. Give another name.", field=path.name)
        return path

    def _fine(self, name: str) -> bool:
        try:
            self.existing(name)
        except InputError:
            return False
        return True

    def _inside(self, name: str) -> Path:
        _check(name)
        path = (self.root / name).resolve()  # links and all
        if not path.is_relative_to(self.root) or path == self.root:
            raise InputError("leads out of the working folder.", field=_shown(name))
        return path


@contextmanager
def received(name: str, data: bytes) -> Iterator[Path]:
    """A file that was sent, alone in a folder of its own for as long as it is read; then it is gone."""
    base = name.replace("\\", "/").rpartition("/")[2]
    _check(base)
    with tempfile.TemporaryDirectory(prefix="nectosome-") as folder:
        path = Path(folder) / base
        path.write_bytes(data)
        yield path


def _check(name: str) -> None:
    """Raise InputError for what is no plain name below a folder, on any system."""
    parts = PurePosixPath(name).parts if name.isprintable() else ()
    wrong = (
        not parts
        or len(name) > _LONGEST
        or name != "/".join(parts)
        or any(c in name for c in '\\:*?"<>|')
        or any(p.startswith((".", " ", "/")) or p.endswith((".", " ")) for p in parts)
        or any(p.partition(".")[0].upper() in _RESERVED for p in parts)
    )
    if wrong:
        raise InputError("is no name of a file in the working folder.", field=_shown(name))


def _shown(name: str) -> str:
    return "".join(c if c.isprintable() else " " for c in name[:_LONGEST])

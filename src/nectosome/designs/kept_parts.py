"""What long computations are made of: parts, each kept as it comes in, so that the same command goes on from them."""

from collections.abc import Callable, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

import numpy as np

from nectosome.io import load_checkpoint, save_checkpoint
from nectosome.io.atomic import OwnFolder
from nectosome.io.file_system import entries, exists
from nectosome.search.executors.spread import spread
from nectosome.units import InputError

Part = dict[str, np.ndarray]
Progress = Callable[[str, float], bool | None]  # of what is computed and the share done; False cancels
_PART = "part-{}.npz"  # file of a finished part


def forget(folder: Path) -> None:
    """Remove finished parts, and their folder unless something else is in it.

    Where another process has begun to use them, they stay.
    """
    try:
        own = OwnFolder(folder)
    except InputError:
        return
    with own:
        for path in [*entries(folder, _PART.format("*")), folder / "lock"]:
            path.unlink(missing_ok=True)
        if not entries(folder):
            folder.rmdir()


class Parts:
    """Finished parts of one computation, kept in a folder of this process's own if there is one.

    Raises InputError where the folder cannot be written, another process has it, or it holds parts of something else.
    """

    def __init__(self, folder: Path | None, key: str):
        self.folder, self.key = folder, key
        if folder is None:
            return
        self._lock = OwnFolder(folder)
        if any(load_checkpoint(path)[1].get("computation") != key for path in entries(folder, _PART.format("*"))):
            self._lock.close()
            raise InputError("holds parts of another computation. Take another folder, or remove it.", file=str(folder))

    def __enter__(self) -> "Parts":
        return self

    def __exit__(self, *_: object) -> None:
        if self.folder is not None:
            self._lock.close()

    def computed(
        self,
        calls: Sequence[tuple[int, Callable[..., Part], tuple[Any, ...]]],
        words: str,
        progress: Progress | None,
        executor: Executor,
    ) -> dict[int, Part]:
        """Parts of calls (number, function, arguments) by their numbers; after a cancellation some are missing.

        progress(words, share) is called twice a second and after each part, and cancels where it returns False.
        """
        found = {k: part for k, *_ in calls if (part := self.get(k)) is not None}
        stopped = False

        def going() -> bool:
            nonlocal stopped
            stopped = stopped or (progress is not None and progress(words, len(found) / len(calls)) is False)
            return not stopped

        for k, part in spread(executor, (call for call in calls if call[0] not in found), going):
            self.keep(k, part)
            if not stopped:
                found[k] = part
        return found

    def get(self, k: int) -> Part | None:
        """Part k; None where it is not kept."""
        path = self._path(k)
        return load_checkpoint(path)[0] if path is not None and exists(path) else None

    def keep(self, k: int, part: Part) -> None:
        """Keep part k."""
        path = self._path(k)
        if path is not None:
            save_checkpoint(path, part, {"computation": self.key})

    def _path(self, k: int) -> Path | None:
        return None if self.folder is None else self.folder / _PART.format(f"{k:05d}")

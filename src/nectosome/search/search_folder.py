"""The folder of a search: what was requested in `search.json`, one journal a start, and a lock."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from nectosome.io.atomic import OwnFolder, write_atomic
from nectosome.io.file_system import entries, exists, read_bytes
from nectosome.io.journal import has_records, read_journal
from nectosome.units import InputError

from .contract import Optimiser
from .evaluations import decode
from .task import Evaluation, Task

FORMAT = 2
FILE = "search.json"
_SAID = {
    "task": "another task",
    "names": "other variables",
    "constraint_names": "other constraints",
    "tolerance": "another tolerance",
    "optimiser": "another optimiser, or other options of it",
    "seed": "another seed",
    "draws": "another number of draws",
}


class SearchFolder:
    """A folder that is this process's own until it is closed.

    - draws: how many designs may be drawn for a start; 0 for a single search, which goes on with more evaluations too.

    One in which nothing was evaluated binds nobody: any search may take it, and one that fails leaves none.

    Raises InputError where it cannot be written, another process has it, or it holds other work or more starts.
    """

    def __init__(
        self,
        path: str | Path,
        task: Task,
        optimiser: Optimiser,
        seed: int,
        *,
        starts: int = 1,
        draws: int = 0,
        about: Mapping[str, Any] | None = None,
    ):
        self.path = Path(path)
        described = optimiser.describe()
        if not draws:
            del described["evaluations"]
        request = {
            "task": task.key(),
            "names": list(task.names),
            "constraint_names": list(task.constraint_names),
            "tolerance": task.tolerance,
            "optimiser": json.loads(json.dumps(described)),
            "seed": seed,
            "draws": draws,
        }
        self._digest = _digest(request)
        self._lock = OwnFolder(self.path)
        try:
            self._settle(request, starts, about)
        except BaseException:
            self._lock.close()
            raise

    def journal(self, number: int) -> tuple[Path, str]:
        """Return the path and the key of the journal of a start."""
        return _journal(self.path, self._digest, number)

    def __enter__(self) -> "SearchFolder":
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        if kind is not None and not self._evaluated:
            for file in (self.path / FILE, *self._journals):
                file.unlink(missing_ok=True)
        self._lock.close()

    @property
    def _journals(self) -> list[Path]:
        return entries(self.path, "start_*.jsonl")

    @property
    def _evaluated(self) -> bool:
        """Whether it holds an evaluation."""
        return any(map(has_records, self._journals))

    def _settle(self, request: dict[str, Any], starts: int, about: Mapping[str, Any] | None) -> None:
        """Write the request down, or check that it is the one before."""
        held = read_search(self.path) if exists(self.path / FILE) else None
        if not self._evaluated:
            for file in self._journals:
                file.unlink()
            held = {"format": FORMAT, **request, "starts": 0, "about": {}}
        elif held is None:
            raise InputError(f"holds starts, but no {FILE}. Take another folder.", file=str(self.path))
        else:
            for name, said in _SAID.items():
                if held[name] != request[name]:
                    old, new = (json.dumps(value) for value in (held[name], request[name]))
                    detail = f" ({old}, now {new})" if len(old) + len(new) < 200 else ""
                    raise InputError(f"holds {said}{detail}. Take another folder.", file=str(self.path))
            if held["starts"] > starts:
                raise InputError(
                    f"holds {held['starts']} starts, {starts} are asked for. Ask for as many or more, or take another "
                    "folder.",
                    file=str(self.path),
                )
        new = held | {"starts": starts, "about": dict(about) if about is not None else held["about"]}
        if new != held:
            write_atomic(self.path / FILE, json.dumps(new, indent=2).encode())


def read_search(folder: str | Path) -> dict[str, Any]:
    """Return what a folder was made for: task, optimiser, seed, draws, starts, and `about`, as the caller gave it.

    Raises InputError where there is none, or it is damaged or of another version.
    """
    file = Path(folder) / FILE
    content = read_bytes(file)
    try:
        held = json.loads(content)
    except (ValueError, RecursionError):
        raise InputError("cannot be read: it is damaged.", file=str(file)) from None
    if not isinstance(held, dict) or held.get("format") != FORMAT or not {*_SAID, "starts", "about"} <= held.keys():
        raise InputError("is of another version of nectosome. Take another folder.", file=str(file))
    kinds: dict[str, type] = {"optimiser": dict, "about": dict, "starts": int, "seed": int}
    if not all(isinstance(held[name], kind) for name, kind in kinds.items()) or "name" not in held["optimiser"]:
        raise InputError("cannot be read: it is damaged.", file=str(file))
    return held


def read_starts(folder: str | Path) -> list[list[Evaluation]]:
    """Return the evaluations of each start that a folder holds so far, drawn designs first; its run may be under way.

    Raises InputError as `read_search` does, and for a start that belongs to other work.
    """
    held = read_search(folder)
    digest = _digest({name: held[name] for name in _SAID})
    journals = (_journal(Path(folder), digest, k) for k in range(held["starts"]))
    found = [read_journal(path, key)[0] if exists(path) else [] for path, key in journals]
    return [[e for record in records if "end" not in record for e in decode(record)] for records in found]


def finished_starts(folder: str | Path) -> list[Path]:
    """Return the journals of the starts that came to their end. Raises InputError as `read_starts` does."""
    held = read_search(folder)
    digest = _digest({name: held[name] for name in _SAID})
    journals = (_journal(Path(folder), digest, k) for k in range(held["starts"]))
    return [path for path, key in journals if exists(path) and "end" in (read_journal(path, key)[0] or [{}])[-1]]


def _digest(request: dict[str, Any]) -> str:
    return hashlib.sha256(json.dumps(request, sort_keys=True).encode()).hexdigest()


def _journal(folder: Path, digest: str, number: int) -> tuple[Path, str]:
    return folder / f"start_{number:04d}.jsonl", f"{digest} {number}"

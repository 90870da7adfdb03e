"""The folder of a search: what was requested in `search.json`, one journal a start, and a lock."""

import hashlib
import json
import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from nectosome.io.atomic import OwnFolder, write_atomic
from nectosome.io.file_system import entries, exists, make_folder, read_bytes
from nectosome.io.journal import has_records, read_journal
from nectosome.search.contract import Optimiser
from nectosome.search.evaluations import decode
from nectosome.search.task import Evaluation, Task
from nectosome.units import InputError

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
_MOST = 1_000_000


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


def read_share(text: str, field: str) -> tuple[int, int]:
    """Number of a share, from 1, and of how many, of a text such as 2/8. Raises InputError."""
    match = re.fullmatch(r"(\d{1,7})/(\d{1,7})", text.strip())
    k, n = map(int, match.groups()) if match else (0, 0)
    if not 1 <= k <= n <= _MOST:
        raise InputError(f'"{text}" is no share. Write K/N: 2/8 is the second of eight, the last one 8/8.', field=field)
    return k, n


def gather_starts(folders: Iterable[str | Path], out: str | Path) -> int:
    """Join folders of one search, each with a share of its starts, into another; return how many starts there are.

    The same search finds all of them there. Each categorical choice has a folder of its own within.

    Raises InputError for folders of different searches, and where a start is missing, not at its end, or there twice.
    """
    folders = [Path(folder) for folder in folders]
    if entries(out):
        raise InputError("holds files already. Give another folder.", file=str(out))
    inner = sorted({file.parent.relative_to(one) for one in folders for file in _searches(one)})
    if not inner:
        raise InputError(f"is no folder of a search: it has no {FILE}.", file=str(folders[0]) if folders else None)
    copies = dict[Path, bytes]()
    number = 0
    for own in inner:
        searches = [folder / own for folder in folders]
        first = read_search(searches[0])
        for other in searches[1:]:
            if read_search(other) != first:
                raise InputError(f"is of another search than {searches[0]}.", file=str(other))
        where = dict[str, Path]()
        for folder in searches:
            for file in finished_starts(folder):
                if file.name in where:
                    raise InputError(f"and {where[file.name]} are the same start. Leave one out.", file=str(file))
                where[file.name] = file
        missing = first["starts"] - len(where)
        if missing:
            words = f"{missing} of {first['starts']} starts are missing, or not at their end"
            raise InputError(f"{words}. Run their shares again: each goes on.", file=str(own) if own.name else None)
        number += len(where)
        copies |= {Path(out) / own / FILE: json.dumps(first, indent=2).encode()}
        copies |= {Path(out) / own / name: read_bytes(file) for name, file in where.items()}
    for path, content in copies.items():
        make_folder(path.parent)
        write_atomic(path, content)
    return number


def _searches(folder: Path) -> list[Path]:
    return [file for file in (folder / FILE, *entries(folder, f"choice_*/{FILE}")) if exists(file)]

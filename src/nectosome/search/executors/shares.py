"""Starts of a search in shares, each in a folder of its own, and the folder of all that is made of them."""

import json
import re
from collections.abc import Iterable
from pathlib import Path

from nectosome.io.atomic import write_atomic
from nectosome.io.file_system import entries, exists, make_folder, read_bytes
from nectosome.units import InputError

from ..search_folder import FILE, finished_starts, read_search

_MOST = 1_000_000


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

"""How much of a file is read: columns, and bytes when it is unpacked."""

import math
import re
from collections.abc import Iterable

from nectosome.units import InputError, shorten

COLUMNS = 5_000  # a few seconds in the slowest format, and more than any rig has
MEMORY = 1_000_000_000  # bytes
_SIZE = re.compile(r"(\d+(?:\.\d+)?)\s*([kMG]?B)")
_BYTES = {"B": 1, "kB": 1e3, "MB": 1e6, "GB": 1e9}


def check_columns(count: int) -> None:
    """Raise InputError for more columns than are read."""
    if count > COLUMNS:
        why = f"has {count} columns, and {COLUMNS} are read at most"
        raise InputError(f"{why}. If its samples run along its rows, transpose it; else save a part of its columns.")


def check_memory(
    sizes: Iterable[float], memory: float, what: str = "it holds when it is unpacked", share: float = 1.0
) -> None:
    """Raise InputError where these sizes [bytes] are more than their share of the `memory` that one file may take."""
    total = sum(sizes)
    if total > share * memory:
        why = f"{show_size(total)} are what {what}, and {show_size(share * memory)} are allowed"
        more = f"{math.ceil(1e-9 * total / share)}GB"
        raise InputError(
            f"{why}. Allow more by measure --memory {more}, if the file can be trusted, or save less of it."
        )


def read_size(text: str, field: str) -> int:
    """Return a size such as `2GB` [bytes]. Raises InputError, which names the field."""
    match = _SIZE.fullmatch(text.strip())
    if match is None or not float(match[1]):
        raise InputError(f'"{shorten(text)}" is no size, as in "500MB" or "2GB".', field=field)
    return round(float(match[1]) * _BYTES[match[2]])


def show_size(size: float) -> str:
    """Write a size [bytes] in a convenient unit."""
    unit = next((name for name in ("GB", "MB", "kB") if size >= _BYTES[name]), "B")
    return f"{size / _BYTES[unit]:.3g} {unit}"

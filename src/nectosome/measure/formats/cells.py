"""What stands in the cells of a worksheet: numbers, times, texts, and formulas or errors instead of a number."""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime, time, timedelta
from typing import Any, Literal, TypeAlias

Kind: TypeAlias = Literal["empty", "missing", "number", "time", "text"]

_MISSING = {"nan", "n/a", "na", "#n/a", "-", "--", "null", "none"}
_DAY = 86400.0  # seconds


@dataclass(frozen=True)
class Broken:
    """A cell that should have a number, but has none: why, and what helps."""

    why: str


UNCALCULATED = Broken("has a formula without a value. Open the workbook in Excel or LibreOffice, and save it there")


def kind(cell: Any) -> Kind:
    """Return what a cell holds; a broken one counts as a number, "n/a" and the like as missing."""
    if cell is None:
        return "empty"
    if isinstance(cell, datetime | date | time | timedelta):
        return "time"
    if not isinstance(cell, str):
        return "number"
    word = cell.strip().lower()
    return "missing" if word in _MISSING else "text" if word else "empty"


def count(row: Sequence[Any], *kinds: Kind) -> int:
    """Return how many cells of a row are of these kinds."""
    return sum(kind(cell) in kinds for cell in row)


def seconds(cell: Any) -> float:
    """Return a time as seconds since the zero of Excel's days."""
    from openpyxl.utils.datetime import to_excel

    return float(to_excel(cell)) * _DAY


def as_number(cell: Any, origin: float | None) -> float:
    """Return the number in a cell, nan where it is empty; in a column of times, seconds since its `origin`.

    Raises ValueError that says why there is none.
    """
    if origin is None and type(cell) in (int, float):  # most cells
        return float(cell)
    what = kind(cell)
    if what in ("empty", "missing"):
        return float("nan")
    if isinstance(cell, Broken):
        raise ValueError(cell.why)
    if what == "text":
        raise ValueError(f'"{cell.strip()}" is text, not a number. Correct the cell, or empty it')
    if what == "time" and origin is not None:
        return round(seconds(cell) - origin, 3)  # as fine as openpyxl reads times
    if (what == "time") != (origin is not None):
        here, above = ("a time", "numbers") if what == "time" else ("a number", "times")
        raise ValueError(f"{cell} is {here} below {above}. Give the whole column one format")
    return float(cell)

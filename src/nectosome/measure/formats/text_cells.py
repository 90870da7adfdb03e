"""Cells of a line of text, and what each of them is."""

import csv
import re
from contextlib import suppress
from enum import Enum

import pandas as pd

from nectosome.io.errors import shorten

BLANKS = " "  # as a delimiter: any number of blanks and tabs
COMMENT = ("#", "%")

# fmt: off
MISSING = frozenset([
    "", "-", "--", "nan", "NaN", "NAN", "Nan", "-nan", "-NaN", "+nan", "NA", "N/A", "n/a", "#N/A", "null", "NULL",
    "None", "1.#QNAN", "-1.#IND",  # as old C libraries on Windows write nan
])
# fmt: on

_EXPONENT = r"(?:[eE][-+]?\d+)?"
_INFINITE = r"(?i:inf(?:inity)?)"
_NUMBER = {
    ".": re.compile(rf"[-+]?(?:(?:\d+\.?\d*|\.\d+){_EXPONENT}|{_INFINITE})", re.ASCII),
    # no digit left out after a comma: "1, 2" is two cells, not a number with a decimal comma and another
    ",": re.compile(rf"[-+]?(?:(?:\d+(?:,\d+)?|,\d+){_EXPONENT}|{_INFINITE})", re.ASCII),
}
_THOUSANDS = re.compile(
    r"[-+]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d*|(?:\.\d{3})+,\d*|(?:,\d{3}){2,}|(?:\.\d{3}){2,})", re.ASCII
)
_MOMENT = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?(?:Z|[-+]\d\d:?\d\d)?", re.ASCII)
_GAP = re.compile("[ \t]+")


class Kind(Enum):
    """What a cell is, or the cells of a column."""

    NUMBER = "number"
    MISSING = "missing"
    MOMENT = "date-time"
    TEXT = "text"


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of `line` without quotation marks and blanks around them; ValueError if a quotation is open."""
    if delimiter == BLANKS:
        line = line.strip(" \t")
    if '"' in line:
        line = line.replace("\t", " ") if delimiter == BLANKS else line
        try:
            cells = next(csv.reader([line], delimiter=delimiter, skipinitialspace=True, strict=True))
        except csv.Error:
            raise ValueError("the quotation marks do not pair. Close them, or put # before the line.") from None
    else:
        cells = _GAP.split(line) if delimiter == BLANKS else line.split(delimiter)
    return [cell.strip(" \t") for cell in cells]


def kind(cell: str, decimal: str) -> Kind:
    """Return what a cell is where `decimal` is the decimal sign."""
    if cell in MISSING:
        return Kind.MISSING
    if _NUMBER[decimal].fullmatch(cell):
        return Kind.NUMBER
    return Kind.MOMENT if _MOMENT.fullmatch(cell) else Kind.TEXT


def number(cell: str, decimal: str) -> float:
    """Return the number in a cell, nan where it is missing; ValueError with the way out where it is none."""
    if cell in MISSING:
        return float("nan")
    if _NUMBER[decimal].fullmatch(cell):
        return float(cell.replace(decimal, "."))
    raise ValueError(not_a_number(cell, decimal))


def moment(cell: str) -> pd.Timestamp:
    """Return the time in a cell, UTC where it names no zone; ValueError where it is none."""
    time = None
    if _MOMENT.fullmatch(cell):
        with suppress(ValueError):
            time = pd.Timestamp(cell)
    if not isinstance(time, pd.Timestamp):
        raise ValueError(f'"{shorten(cell)}" is not a date and time. Write year-month-day hour:minute:second.')
    return time.tz_localize("UTC") if time.tz is None else time.tz_convert("UTC")


def count_cells(count: int) -> str:
    """Return `1 cell`, `2 cells`."""
    return f"{count} cell{'s' * (count != 1)}"


def not_a_number(cell: str, decimal: str) -> str:
    """Return why a cell is not a number, and the way out."""
    shown = f'"{shorten(cell)}"'
    if has_thousands(cell):
        return f"{shown} has separators between thousands. Write the file without them."
    if other_decimal(cell, decimal):
        words = ("a decimal comma", "points", "comma") if decimal == "." else ("a decimal point", "commas", "point")
        return (
            f'{shown} has {words[0]} in a file with {words[1]}. Set decimal to "{words[2]}" if that is the right sign.'
        )
    return f"{shown} is not a number. Correct it, or leave the cell empty where there is no value."


def has_thousands(cell: str) -> bool:
    """Whether a cell is a number with separators between thousands, beyond doubt."""
    return _THOUSANDS.fullmatch(cell) is not None


def other_decimal(cell: str, decimal: str) -> bool:
    """Whether a cell would be a number with the other decimal sign only."""
    other = "," if decimal == "." else "."
    return other in cell and _NUMBER[other].fullmatch(cell) is not None

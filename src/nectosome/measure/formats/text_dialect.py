"""Cells of a line of text, and what each of them is."""

import csv
import re
from collections import Counter
from contextlib import suppress
from enum import Enum
from typing import NamedTuple

import pandas as pd

from nectosome.measure.formats.source import Options
from nectosome.units import InputError, shorten

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


class CellKind(Enum):
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


def kind(cell: str, decimal: str) -> CellKind:
    """Return what a cell is where `decimal` is the decimal sign."""
    if cell in MISSING:
        return CellKind.MISSING
    if _NUMBER[decimal].fullmatch(cell):
        return CellKind.NUMBER
    return CellKind.MOMENT if _MOMENT.fullmatch(cell) else CellKind.TEXT


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


DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", BLANKS: "blanks"}  # the likeliest first
DECIMALS = {".": "point", ",": "comma"}
SURE = (CellKind.NUMBER, CellKind.MOMENT)
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)  # as well as a number with a decimal comma


class _Reading(NamedTuple):
    """One way to cut lines into cells, and what speaks for it."""

    delimiter: str
    decimal: str
    width: int  # cells of most rows
    score: float  # share of the lines that are rows of that width, weighed by their share of numbers
    named: int  # lines of text of that width


def choose(lines: list[str], options: Options, file: str) -> tuple[str, str, int]:
    """Return delimiter, decimal sign and number of cells under which most of the lines are numbers."""
    delimiters = list(DELIMITERS) if options.delimiter is None else [_told(options.delimiter, DELIMITERS, file)]
    decimals = list(DECIMALS) if options.decimal is None else [_told(options.decimal, DECIMALS, file)]
    readings = [_read(lines, delimiter, decimal) for delimiter in delimiters for decimal in decimals]
    best = max(readings, key=lambda reading: (reading.score, reading.named))  # of equals the first
    if best.delimiter == BLANKS:  # to which a row with a tab too many is as good as any
        tabs = (x for x in readings if x.delimiter == "\t" and x.decimal == best.decimal)
        best = next((x for x in tabs if x.width > 1 and x.score > 0.8 * best.score), best)
    if best.score == 0.0:
        said = f' Its last line reads "{shorten(lines[-1])}".' if lines else ""
        raise InputError(f"there is no row of numbers.{said}", file=file)
    if options.decimal is None:
        best = _check_commas(lines, best, readings, file)
    return best.delimiter, best.decimal, best.width


def _check_commas(lines: list[str], best: _Reading, readings: list[_Reading], file: str) -> _Reading:
    """Return the reading to take; InputError where `1,5` or `1,234` could as well be something else."""
    pairs = next((x for x in readings if x[:3] == (",", ".", 2) and x.score > 0.0), None)
    single = next((x for x in readings if x.decimal == "," and x.width == 1), None)
    if pairs and single and best in (pairs, single) and min(pairs.score, single.score) > best.score / 2:
        if pairs.named and any(re.search(r",\S", line) for line in lines if not _has_number(line)):
            return pairs  # as its names are
        if not any(re.search(r",0\d", line) for line in lines):
            number = next(line for line in reversed(lines) if "," in line and _has_number(line))
            way_out = 'Set decimal to "comma" or "point".'
            raise InputError(f'"{shorten(number)}" is one number with a decimal comma, or two. {way_out}', file=file)
        return single
    if best.decimal == ",":
        cells = (cell for line in lines for cell in cut(line, best.delimiter))
        marked = [cell for cell in cells if "," in cell and kind(cell, ",") == CellKind.NUMBER]
        if marked and all(_GROUPED.fullmatch(cell) for cell in marked):
            said = f'"{marked[0]}" has a decimal comma, or a separator between thousands'
            way_out = 'Set decimal to "comma", or write the file without separators between thousands.'
            raise InputError(f"{said}. {way_out}", file=file)
    return best


def _has_number(line: str) -> bool:
    """Whether a line, cut at its commas, has cells that are numbers."""
    return any(kind(cell, ".") == CellKind.NUMBER for cell in cut(line, ","))


def _told(value: str, known: dict[str, str], file: str) -> str:
    """Return the sign for what an option says, which is the sign itself or its name."""
    signs = {name: sign for sign, name in known.items()}
    if value in signs:
        return signs[value]
    if value in known:
        return value
    what = "delimiter" if known is DELIMITERS else "decimal sign"
    raise InputError(f'there is no {what} "{shorten(value)}"; give {", ".join(signs)}.', file=file)


def _read(lines: list[str], delimiter: str, decimal: str) -> _Reading:
    rows = [cut(line, delimiter) for line in lines]
    found = [[kind(cell, decimal) for cell in row] for row in rows]
    sure = [sum(cell in SURE for cell in row) for row in found]
    widths = Counter(len(row) for row, count in zip(rows, sure, strict=True) if count)
    width = widths.most_common(1)[0][0] if widths else 0
    score = 0.0
    for row, what, count in zip(rows, found, sure, strict=True):
        if count and len(row) == width:
            texts = [cell for cell, is_ in zip(row, what, strict=True) if is_ == CellKind.TEXT]
            uncut = sum(any(sign in cell for sign in "\t;|") for cell in texts)  # hardly a text, rather several cells
            score += count / (count + len(texts) + 2 * uncut)
    named = sum(len(row) == width for row, count in zip(rows, sure, strict=True) if not count)
    return _Reading(delimiter, decimal, width, score / max(1, len(lines)), named)


def cut(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, or all of it where it cannot be cut."""
    try:
        return split(line, delimiter)
    except ValueError:
        return [line]

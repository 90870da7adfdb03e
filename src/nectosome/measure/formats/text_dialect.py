"""Dialect of a text table: its delimiter, its decimal sign, and the kinds of its cells."""

import csv
import re
from collections import Counter
from collections.abc import Sequence
from enum import Enum
from typing import NamedTuple

from nectosome.measure.formats.clock_text import is_date_time, is_time_of_day
from nectosome.measure.formats.source import Options
from nectosome.units import InputError, shorten

BLANKS = " "  # as a delimiter: any number of blanks and tabs
COMMENT = ("#", "%")

# fmt: off
MISSING = frozenset([
    "", "-", "--", "nan", "NaN", "NAN", "Nan", "-nan", "-NaN", "+nan", "NA", "N/A", "n/a", "#N/A", "null", "NULL",
    "None", "1.#QNAN", "-1.#IND",  # NaN of old C libraries on Windows
])
# fmt: on

_EXPONENT = r"(?:[eE][-+]?\d+)?"
_INFINITE = r"(?i:inf(?:inity)?)"
_NUMBER = {
    ".": re.compile(rf"[-+]?(?:(?:\d+\.?\d*|\.\d+){_EXPONENT}|{_INFINITE})", re.ASCII),
    # a decimal comma needs a digit after it: "1, 2" is two cells
    ",": re.compile(rf"[-+]?(?:(?:\d+(?:,\d+)?|,\d+){_EXPONENT}|{_INFINITE})", re.ASCII),
}
_THOUSANDS = re.compile(
    r"[-+]?[1-9]\d{0,2}(?:(?:,\d{3})+\.\d*|(?:\.\d{3})+,\d*|(?:,\d{3}){2,}|(?:\.\d{3}){2,})", re.ASCII
)
_NAME = r"[A-Za-z_][^,\s]*(?: ?[\[(][^,]*[\])])?"
_NAMES = re.compile(rf"\s*[#%]\s*{_NAME},{_NAME}\s*")  # two names in a comment
_COMMA_SECONDS = re.compile(r":\d\d,\d")
_GAP = re.compile("[ \t]+")
DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", BLANKS: "blanks"}  # most probable first
DECIMALS = {".": "point", ",": "comma"}
_GROUPED = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)  # could also be a number with a decimal comma


class CellKind(Enum):
    """Kind of a cell, or of all cells of a column."""

    NUMBER = "number"
    MISSING = "missing"
    DATE_TIME = "date-time"
    TIME_OF_DAY = "time of day"
    TEXT = "text"


def split(line: str, delimiter: str) -> list[str]:
    """Return the cells of `line`, stripped of quotation marks and blanks; ValueError for an open quotation."""
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
    """Return the kind of a cell, with `decimal` as the decimal sign."""
    if cell in MISSING:
        return CellKind.MISSING
    if _NUMBER[decimal].fullmatch(cell):
        return CellKind.NUMBER
    if ":" not in cell or (decimal == "." and _COMMA_SECONDS.search(cell)):
        return CellKind.TEXT
    return CellKind.DATE_TIME if is_date_time(cell) else CellKind.TIME_OF_DAY if is_time_of_day(cell) else CellKind.TEXT


def number(cell: str, decimal: str) -> float:
    """Return the number in a cell, NaN for a missing value; ValueError for anything else, with the remedy."""
    if cell in MISSING:
        return float("nan")
    if _NUMBER[decimal].fullmatch(cell):
        return float(cell.replace(decimal, "."))
    raise ValueError(not_a_number(cell, decimal))


def not_a_number(cell: str, decimal: str) -> str:
    """Return why a cell is not a number, and the remedy."""
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
    """Whether a cell is certainly a number with thousands separators."""
    return _THOUSANDS.fullmatch(cell) is not None


def other_decimal(cell: str, decimal: str) -> bool:
    """Whether a cell is a number only with the other decimal sign."""
    other = "," if decimal == "." else "."
    return other in cell and _NUMBER[other].fullmatch(cell) is not None


CLOCK = (CellKind.DATE_TIME, CellKind.TIME_OF_DAY)
NUMERIC = (CellKind.NUMBER, *CLOCK)


class _Dialect(NamedTuple):
    """A candidate dialect, and how well it fits the lines."""

    delimiter: str
    decimal: str
    width: int  # cells of most rows
    score: float  # share of the lines that are rows of that width, weighted by their share of numbers
    named: int  # text lines of that width


def choose(lines: list[str], options: Options, file: str, comments: Sequence[str] = ()) -> tuple[str, str, int]:
    """Return the delimiter, decimal sign and cells per row with which most lines are numbers.

    `comments` are the lines above the table that a sign marks as such; one may hold its names.
    """
    delimiters = list(DELIMITERS) if options.delimiter is None else [_sign(options.delimiter, DELIMITERS, file)]
    decimals = list(DECIMALS) if options.decimal is None else [_sign(options.decimal, DECIMALS, file)]
    dialects = [_read(lines, delimiter, decimal) for delimiter in delimiters for decimal in decimals]
    best = max(dialects, key=lambda dialect: (dialect.score, dialect.named))  # the first of equals
    if best.delimiter == BLANKS:  # blanks also accept a row with one tab too many
        tabs = (x for x in dialects if x.delimiter == "\t" and x.decimal == best.decimal)
        best = next((x for x in tabs if x.width > 1 and x.score > 0.8 * best.score), best)
    if best.score == 0.0:
        message = f' Its last line reads "{shorten(lines[-1])}".' if lines else ""
        raise InputError(f"there is no row of numbers.{message}", file=file)
    if options.decimal is None:
        best = _check_commas(lines, best, dialects, file, any(_NAMES.fullmatch(line) for line in comments))
    return best.delimiter, best.decimal, best.width


def _check_commas(lines: list[str], best: _Dialect, dialects: list[_Dialect], file: str, two_names: bool) -> _Dialect:
    """Return the dialect to use; InputError if `1,5` or `1,234` is ambiguous. `two_names`: a comment has two."""
    pairs = next((x for x in dialects if x[:3] == (",", ".", 2) and x.score > 0.0), None)
    single = next((x for x in dialects if x.decimal == "," and x.width == 1), None)
    if pairs and single and best in (pairs, single) and min(pairs.score, single.score) > best.score / 2:
        if two_names or (pairs.named and any(re.search(r",\S", line) for line in lines if not _has_number(line))):
            return pairs  # its names are separated by commas, too
        if not any(re.search(r",0\d", line) for line in lines):
            number = next(line for line in reversed(lines) if "," in line and _has_number(line))
            remedy = 'Set decimal to "comma" or "point".'
            raise InputError(f'"{shorten(number)}" is one number with a decimal comma, or two. {remedy}', file=file)
        return single
    if best.decimal == ",":
        cells = (cell for line in lines for cell in split_or_whole(line, best.delimiter))
        marked = [cell for cell in cells if "," in cell and kind(cell, ",") == CellKind.NUMBER]
        if marked and all(_GROUPED.fullmatch(cell) for cell in marked):
            message = f'"{marked[0]}" has a decimal comma, or a separator between thousands'
            remedy = 'Set decimal to "comma", or write the file without separators between thousands.'
            raise InputError(f"{message}. {remedy}", file=file)
    return best


def _has_number(line: str) -> bool:
    """Whether a line, split at its commas, has numeric cells."""
    return any(kind(cell, ".") == CellKind.NUMBER for cell in split_or_whole(line, ","))


def _sign(value: str, known: dict[str, str], file: str) -> str:
    """Return the sign that an option gives by itself or by its name."""
    signs = {name: sign for sign, name in known.items()}
    if value in signs:
        return signs[value]
    if value in known:
        return value
    what = "delimiter" if known is DELIMITERS else "decimal sign"
    raise InputError(f'there is no {what} "{shorten(value)}"; give {", ".join(signs)}.', file=file)


def _read(lines: list[str], delimiter: str, decimal: str) -> _Dialect:
    rows = [split_or_whole(line, delimiter) for line in lines]
    kinds = [[kind(cell, decimal) for cell in row] for row in rows]
    numeric = [sum(cell in NUMERIC for cell in row) for row in kinds]
    widths = Counter(len(row) for row, count in zip(rows, numeric, strict=True) if count)
    width = widths.most_common(1)[0][0] if widths else 0
    score = 0.0
    for row, what, count in zip(rows, kinds, numeric, strict=True):
        if width == 1 and _COMMA_SECONDS.search(row[0]):
            continue  # a time and a number beside it, more probably than a time with a decimal comma alone
        if count and len(row) == width:
            texts = [cell for cell, is_ in zip(row, what, strict=True) if is_ == CellKind.TEXT]
            uncut = sum(any(sign in cell for sign in "\t;|") for cell in texts)  # probably several cells, not one text
            score += count / (count + len(texts) + 2 * uncut)
    named = sum(len(row) == width for row, count in zip(rows, numeric, strict=True) if not count)
    return _Dialect(delimiter, decimal, width, score / max(1, len(lines)), named)


def split_or_whole(line: str, delimiter: str) -> list[str]:
    """Return the cells of a line, or the whole line if it cannot be split."""
    try:
        return split(line, delimiter)
    except ValueError:
        return [line]

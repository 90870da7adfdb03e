"""What stands between the cells of a text and what is its decimal sign, as far as lines can tell."""

import re
from collections import Counter
from typing import NamedTuple

from nectosome.io.errors import InputError, shorten
from nectosome.measure.formats.source import Options
from nectosome.measure.formats.text_cells import BLANKS, Kind, kind, split

DELIMITERS = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", BLANKS: "blanks"}  # the likeliest first
DECIMALS = {".": "point", ",": "comma"}
SURE = (Kind.NUMBER, Kind.MOMENT)
_THOUSANDS = re.compile(r"[-+]?[1-9]\d{0,2},\d{3}", re.ASCII)  # as well as a number with a decimal comma


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
        marked = [cell for cell in cells if "," in cell and kind(cell, ",") == Kind.NUMBER]
        if marked and all(_THOUSANDS.fullmatch(cell) for cell in marked):
            said = f'"{marked[0]}" has a decimal comma, or a separator between thousands'
            way_out = 'Set decimal to "comma", or write the file without separators between thousands.'
            raise InputError(f"{said}. {way_out}", file=file)
    return best


def _has_number(line: str) -> bool:
    """Whether a line, cut at its commas, has cells that are numbers."""
    return any(kind(cell, ".") == Kind.NUMBER for cell in cut(line, ","))


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
            texts = [cell for cell, is_ in zip(row, what, strict=True) if is_ == Kind.TEXT]
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

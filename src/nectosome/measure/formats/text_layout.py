"""How the table of a text file is laid out: found out from its first lines, or taken as told."""

from collections import Counter
from dataclasses import dataclass

from nectosome.io.errors import InputError
from nectosome.measure.formats.source import Options
from nectosome.measure.formats.text_cells import (
    BLANKS,
    COMMENT,
    MISSING,
    Kind,
    count_cells,
    has_thousands,
    kind,
    not_a_number,
    other_decimal,
)
from nectosome.measure.formats.text_delimiter import SURE, choose, cut
from nectosome.measure.formats.text_names import Head, find_head, is_unit_row, name_cells, uncomment, units_of

_JUDGED = 200  # lines by which the delimiter is judged
_LABVIEW = "***End_of_Header***"

Lines = list[tuple[int, str]]  # with their numbers
Cells = list[tuple[int, list[str]]]


@dataclass(frozen=True)
class Layout:
    """Where the table is and how its rows are cut into cells."""

    delimiter: str
    decimal: str
    width: int  # cells of a row
    spare: int  # of these, empty ones behind the last column
    first: int  # line of the first row
    kinds: tuple[Kind, ...]  # of the columns: NUMBER, MOMENT or TEXT
    head: Head
    moments: dict[int, str]  # the first one of each column of date-times


def find_layout(text: str, options: Options, file: str) -> Layout:
    """Return the layout of a text of whole lines; InputError where there is no table or more than one reading."""
    lines = [(n, line) for n, line in enumerate(text.split("\n"), 1) if line.strip()]
    if not lines:
        raise InputError("is empty.", file=file)
    _check_header(options.header, lines, file)
    # LabVIEW heads its files, then their first part
    ends = [n for n, line in lines if line.startswith(_LABVIEW)][:2]
    if not options.header:
        lines = [(n, line) for n, line in lines if n > max(ends, default=0)]
    bare = [(n, line) for n, line in lines if not line.lstrip().startswith(COMMENT)]
    delimiter, decimal, width = choose([line for _, line in bare[-_JUDGED:]], options, file)

    cells = [(n, cut(line, delimiter)) for n, line in bare if n > (options.header or 0)]
    kinds = _kinds([row for _, row in cells[-_JUDGED:] if len(row) == width], decimal, width)
    start = next((i for i, (_, row) in enumerate(cells) if _fits(row, kinds, decimal) and not _counts(row)), None)
    if start is None:
        raise InputError("there is no row of numbers after the line with the names.", file=file, line=options.header)
    while start > 0 and _is_missing(cells[start - 1][1], width):
        start -= 1
    first = cells[start][0]
    if start > 0:
        _check_no_row(*cells[start - 1], kinds, decimal, file)
    rows = [row for _, row in cells[start:] if len(row) == width]
    kinds = _kinds(rows, decimal, width)
    empty = next((i for i, row in enumerate(zip(*map(reversed, rows), strict=True)) if any(row)), width)
    widths = range(max(1, width - empty), width + 1)
    head = _head([(n, line) for n, line in lines if n < first], options, delimiter, decimal, widths, file)
    spare = width - (len(head.names) or len(head.units) or widths[0])
    kinds = kinds[: width - spare]
    for column, what in enumerate(kinds):
        if what == Kind.TEXT:
            _check_no_numbers(column, cells[start:], decimal, head, file)
    moments = {
        j: next(row[j] for row in rows if kind(row[j], decimal) == Kind.MOMENT)
        for j, what in enumerate(kinds)
        if what == Kind.MOMENT
    }
    return Layout(delimiter, decimal, width, spare, first, kinds, head, moments)


def _kinds(rows: list[list[str]], decimal: str, width: int) -> tuple[Kind, ...]:
    """Return of each column what its cells are: numbers or date-times if any are, numbers if there are none."""

    def of(column: int) -> Kind:
        found = Counter(kind(row[column], decimal) for row in rows)
        if any(found[sure] for sure in SURE):
            return max(SURE, key=lambda sure: found[sure])
        return Kind.TEXT if found[Kind.TEXT] else Kind.NUMBER

    return tuple(of(column) for column in range(width))


def _fits(row: list[str], kinds: tuple[Kind, ...], decimal: str) -> bool:
    """Whether a line is a row of the table: as many cells, of the kinds of their columns, at least one of them sure."""
    if len(row) != len(kinds):
        return False
    found = [kind(cell, decimal) for cell in row]
    return any(cell in SURE for cell in found) and all(
        what == Kind.TEXT or cell in (what, Kind.MISSING) for cell, what in zip(found, kinds, strict=True)
    )


def _is_missing(row: list[str], width: int) -> bool:
    """Whether a row has no value, and a word for that, as names and units have not."""
    return len(row) == width and all(cell in MISSING for cell in row) and any(cell.strip("+-") for cell in row)


def _counts(row: list[str]) -> bool:
    """Whether these are the names that pandas writes for columns without: nothing over its index, then 0, 1, 2."""
    return len(row) > 1 and row == ["", *map(str, range(len(row) - 1))]


def _check_no_row(line: int, row: list[str], kinds: tuple[Kind, ...], decimal: str, file: str) -> None:
    """Refuse a line above the first row that seems to be a row with a fault, so that none is lost."""
    found = [kind(cell, decimal) for cell in row]
    if _counts(row) or not any(cell in SURE for cell in found):
        return
    if len(row) == len(kinds):
        cells = zip(row, found, kinds, strict=True)
        wrong = next(cell for cell, is_, what in cells if what != Kind.TEXT and is_ not in (what, Kind.MISSING))
        way_out = f" If this line has the names, set header to {line}." if wrong[:1].isalpha() else ""
        raise InputError(f"{not_a_number(wrong, decimal)}{way_out}", file=file, line=line)
    if 2 * sum(cell in SURE for cell in found) > len(row):
        said = f"{count_cells(len(row))} here, and the rows below have {len(kinds)}"
        raise InputError(f"{said}. Put # before it if it is no row.", file=file, line=line)


def _check_no_numbers(column: int, cells: Cells, decimal: str, head: Head, file: str) -> None:
    """Refuse a column that would be left out as text because its numbers are written in another way."""
    field = (head.names[column] if head.names else "") or f"column {column + 1}"
    for line, row in cells:
        if column < len(row) and (has_thousands(row[column]) or other_decimal(row[column], decimal)):
            raise InputError(not_a_number(row[column], decimal), file=file, line=line, field=field)


def _check_header(header: int | None, lines: Lines, file: str) -> None:
    if header and header not in dict(lines):
        raise InputError(f"header is to be line {header}, where nothing is.", file=file)


def _head(above: Lines, options: Options, delimiter: str, decimal: str, widths: range, file: str) -> Head:
    """Return names and units, checked against the number of columns."""
    if options.header == 0:
        return Head()
    if options.header is not None:
        names = name_cells(uncomment(dict(above)[options.header]), delimiter, widths)
        if not names:
            said = f"there are not {widths[-1]} names in this line"
            raise InputError(f"{said}. Give the line that has them, or 0.", file=file, line=options.header)
        line, below = above[-1]
        units = name_cells(uncomment(below), delimiter, widths) if line > options.header else []
        if not units or not is_unit_row(units):
            return Head(tuple(names), (), options.header)
        return Head(tuple(names), units_of(units, len(names)), options.header, line)
    head = find_head(above, delimiter, decimal, widths)
    if not head.names and not head.units and above and delimiter != BLANKS:
        line, text = above[-1]
        row = cut(text, delimiter)
        sure = any(kind(cell, decimal) in SURE for cell in row)
        if len(row) > 1 and all(row) and not sure and len(row) in (widths[0] - 1, widths[-1] + 1):
            said = f"{len(row)} names here, and the rows have {count_cells(widths[-1])}"
            raise InputError(f"{said}. Name each column, or set header to 0.", file=file, line=line)
    return head

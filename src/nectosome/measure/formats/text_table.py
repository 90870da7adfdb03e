"""Table of a text file: its layout, found from the first lines or given by options, and its rows as numbers."""

import io
import re
from collections import Counter
from dataclasses import dataclass, replace
from itertools import accumulate, islice
from typing import Any

import numpy as np
import pandas as pd

from nectosome.measure.formats.clock_text import TextClock, clock_of
from nectosome.measure.formats.headings import Labels, bare_unit, is_bracketed, is_unit, name_by_groups, split_unit
from nectosome.measure.formats.program_heads import CaptureHead, capture_head
from nectosome.measure.formats.source import Options, Piece
from nectosome.measure.formats.text_dialect import (
    BLANKS,
    CLOCK,
    COMMENT,
    MISSING,
    NUMERIC,
    CellKind,
    choose,
    has_thousands,
    kind,
    not_a_number,
    number,
    other_decimal,
    split,
    split_or_whole,
)
from nectosome.units import InputError, count, shorten

_SINGLE = re.compile(r"(?<! ) (?! )")  # a blank within a name, if two or more separate names
_WIDE_GAP = re.compile(r"\t+| {2,}")
_BEFORE_BRACKET = re.compile(r"[ \t]+(?=[\[(])")
_JUDGED, _FEWEST, _LETTERS = 200, 3, 250_000  # lines that decide the delimiter; fewer if they have so many letters
Lines = list[tuple[int, str]]  # line numbers and lines
Cells = list[tuple[int, list[str]]]
_MARKS = ('"', *COMMENT)
_READ_CSV: Any = pd.read_csv  # its annotations allow neither names by range nor types by position
# from pandas 3.1 on numbers are always read as the nearest float, and it warns of the setting
_NEAREST = {} if tuple(map(int, pd.__version__.split(".")[:2])) >= (3, 1) else {"float_precision": "round_trip"}


@dataclass(frozen=True)
class Head:
    """Cells of the lines with names and units, and the numbers of these lines (0 for none)."""

    names: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    names_line: int = 0
    units_line: int = 0


def find_head(above: Lines, delimiter: str, decimal: str, widths: range) -> Head:
    """Return names and units from the numbered lines above the first row; cells per line must be in `widths`."""

    def fitting(line: str) -> list[str]:
        cells = name_cells(line, delimiter, widths)
        return [] if any(kind(cell, decimal) in NUMERIC for cell in cells) else cells

    plain: Cells = []
    comments: Cells = []
    for n, line in reversed(above):
        cells = fitting(uncomment(line))
        if line.lstrip().startswith(COMMENT):
            comments += [(n, cells)] if len(cells) > 1 else []
        elif cells:
            plain.append((n, cells))
        else:
            break
    lines = plain or comments
    if not lines:
        return Head()
    (number, cells), (upper, more) = lines[0], lines[1] if len(lines) > 1 else (0, [])
    if len(more) == len(cells) and [k for k, cell in enumerate(cells) if cell] == [0] and not more[0]:
        # pandas writes the name of the index below those of the columns
        return Head(tuple(name_by_groups([cells[0], *more[1:]], _above(lines[2:], len(cells)))), (), number)
    bracketed = all(is_bracketed(cell) for cell in cells if cell)
    if bracketed or (more and is_unit_row(cells) and not is_unit_row(more)):
        names = name_by_groups(more, _above(lines[2:], len(more)))
        return Head(tuple(names), units_of(cells, len(more) or len(cells)), upper, number)
    return Head(tuple(name_by_groups(cells, _above(lines[1:], len(cells)))), (), number)


def _above(lines: Cells, count: int) -> list[list[str]]:
    """The cells of the lines above the names, the highest first, as far as they have as many."""
    rows = []
    for _, cells in lines:
        if len(cells) != count:
            break
        rows.insert(0, cells)
    return rows


def name_cells(line: str, delimiter: str, widths: range) -> list[str]:
    """Return the cells of a line of names, none if their number is not in `widths`.

    With blanks as the delimiter, a name may contain blanks: two blanks, a tab or a unit in brackets then end it.
    """
    variants = [line]
    if delimiter == BLANKS:
        variants = [line, _WIDE_GAP.sub(" ", _SINGLE.sub("\0", line.strip())), _BEFORE_BRACKET.sub("\0", line)]
    for variant in variants:
        try:
            cells = [cell.replace("\0", " ") for cell in split(variant, delimiter)]
        except ValueError:
            continue
        named = max((k for k, cell in enumerate(cells, 1) if cell), default=0)
        count = max(named, widths[0])
        if named and count in widths and count <= len(cells):
            return cells[:count]
    return []


def units_of(cells: list[str], count: int) -> tuple[str, ...]:
    """Return the units in a row of units, padded to one per column."""
    return tuple(bare_unit(cell) for cell in [*cells, *[""] * count][:count])


def uncomment(line: str) -> str:
    """Return a line without its comment sign."""
    return line.lstrip().lstrip("".join(COMMENT)).lstrip() if line.lstrip().startswith(COMMENT) else line


def is_unit_row(cells: list[str]) -> bool:
    """Whether every cell is empty or a unit."""
    return all(is_unit(cell) for cell in cells if cell)


@dataclass(frozen=True)
class TextLayout:
    """Position of the table, and how its rows are split into cells."""

    delimiter: str
    decimal: str
    width: int  # cells of a row
    spare: int  # of these, empty cells behind the last column
    first: int  # line of the first row
    kinds: tuple[CellKind, ...]  # of the columns: NUMBER, DATE_TIME, TIME_OF_DAY or TEXT
    head: Head
    clocks: dict[int, TextClock]  # of the columns of times
    capture: CaptureHead | None = None  # of programs' files


def find_layout(lines: Lines, options: Options, file: str) -> TextLayout:
    """Return the layout of a text with these lines; InputError if there is no table or the dialect is ambiguous."""
    lines = [(n, line) for n, line in lines if line.strip()]
    if not lines:
        raise InputError("is empty.", file=file)
    capture = capture_head(lines, options.table, file) if options.header is None else None
    if capture is None and options.table is not None:
        raise InputError("a text file has one table; leave table out.", file=file)
    if capture is not None:
        between = [range(first, last + 1) for first, last in capture.skipped]
        lines = [
            x for x in lines if capture.line < x[0] <= (capture.end or x[0]) and not any(x[0] in r for r in between)
        ]
        options = replace(options, delimiter=capture.delimiter, decimal=options.decimal or capture.decimal, header=0)
    if options.header and options.header not in dict(lines):
        raise InputError(f"header is set to line {options.header}, which is empty.", file=file)
    bare = [(n, line) for n, line in lines if not line.lstrip().startswith(COMMENT)]
    comments = [line for _, line in lines if line.lstrip().startswith(COMMENT)]
    letters = accumulate(len(x) for _, x in reversed(bare))
    judged = max(_FEWEST, sum(total <= _LETTERS for total in islice(letters, _JUDGED)))
    delimiter, decimal, width = choose([x for _, x in bare[-judged:]], options, file, comments)

    cells = [(n, split_or_whole(line, delimiter)) for n, line in bare if n > (options.header or 0)]
    label = _label_column(lines, delimiter, options.labels)
    kinds = _kinds([row for _, row in cells[-judged:] if len(row) == width], decimal, width, label)
    start = next((i for i, (_, row) in enumerate(cells) if _fits(row, kinds, decimal) and not _counts(row)), None)
    if start is None:
        raise InputError("there is no row of numbers after the line with the names.", file=file, line=options.header)
    while start > 0 and _is_missing(cells[start - 1][1], width):
        start -= 1
    first = cells[start][0]
    if start > 0:
        _check_no_row(*cells[start - 1], kinds, decimal, file)
    rows = [row for _, row in cells[start:] if len(row) == width]
    kinds = _kinds(rows, decimal, width, label)
    empty = next((i for i, row in enumerate(zip(*map(reversed, rows), strict=True)) if any(row)), width)
    widths = range(max(1, width - empty), width + 1)
    if capture is None:
        head = _head([(n, line) for n, line in lines if n < first], options, delimiter, decimal, widths, file)
    elif len(capture.names) in widths:
        head = Head(capture.names, capture.units, capture.line)
    else:
        message = f"{len(capture.names)} columns by the head of {capture.program}, and the rows have {width} cells"
        raise InputError(f"{message}. Is a line of the head damaged?", file=file, line=capture.line)
    spare = width - (len(head.names) or len(head.units) or widths[0])
    kinds = kinds[: width - spare]
    for column, what in enumerate(kinds):
        if what == CellKind.TEXT and column != label:
            _check_no_numbers(column, cells[start:], decimal, head, file)
    clocks = {j: _clock(j, rows, kinds, decimal, options, head, file) for j, k in enumerate(kinds) if k in CLOCK}
    return TextLayout(delimiter, decimal, width, spare, first, kinds, head, clocks, capture)


def _clock(
    column: int,
    rows: list[list[str]],
    kinds: tuple[CellKind, ...],
    decimal: str,
    options: Options,
    head: Head,
    file: str,
) -> TextClock:
    """Return the clock of a column of times. Raises InputError for halves of the day in a column of their own."""
    field = (head.names[column] if head.names else "") or f"column {column + 1}"
    beside = {row[column + 1].upper() for row in rows} if column + 1 < len(kinds) else set()
    if beside and beside <= {"AM", "PM"}:
        remedy = "Separate the columns by tabs or commas, or write hours from 0 to 23."
        raise InputError(f"AM and PM are in another column than their times. {remedy}", file=file, field=field)
    cells = [row[column] for row in rows if kind(row[column], decimal) == kinds[column]]
    return clock_of(cells, options.day_first, field, file)


def _label_column(lines: Lines, delimiter: str, chosen: int | str | None) -> int | None:
    """Return the index of a column of labels, by its place or by its name in the first line that has it."""
    if not isinstance(chosen, str):
        return chosen - 1 if chosen is not None else None
    for _, line in lines:
        cells = split_or_whole(uncomment(line), delimiter)
        column = next((j for j, cell in enumerate(cells) if chosen in (cell, split_unit(cell).name)), None)
        if column is not None:
            return column
    return None


def _kinds(rows: list[list[str]], decimal: str, width: int, label: int | None) -> tuple[CellKind, ...]:
    """Return the kind of each column: number or time if any cell is one, number if all cells are missing.

    A column of labels is text, whatever its cells look like.
    """

    def of(column: int) -> CellKind:
        if column == label:
            return CellKind.TEXT
        counts = Counter(kind(row[column], decimal) for row in rows)
        if any(counts[numeric] for numeric in NUMERIC):
            return max(NUMERIC, key=lambda numeric: counts[numeric])
        return CellKind.TEXT if counts[CellKind.TEXT] else CellKind.NUMBER

    return tuple(of(column) for column in range(width))


def _fits(row: list[str], kinds: tuple[CellKind, ...], decimal: str) -> bool:
    """Whether a line is a row: each cell of its column's kind, at least one a number or date-time."""
    if len(row) != len(kinds):
        return False
    actual = [kind(cell, decimal) for cell in row]
    return any(cell in NUMERIC for cell in actual) and all(
        what == CellKind.TEXT or cell in (what, CellKind.MISSING) for cell, what in zip(actual, kinds, strict=True)
    )


def _is_missing(row: list[str], width: int) -> bool:
    """Whether a row has only missing values, at least one of them as a word such as nan."""
    return len(row) == width and all(cell in MISSING for cell in row) and any(cell.strip("+-") for cell in row)


def _counts(row: list[str]) -> bool:
    """Whether these are pandas' names of unnamed columns: empty above the index, then 0, 1, 2."""
    return len(row) > 1 and row == ["", *map(str, range(len(row) - 1))]


def _check_no_row(line: int, row: list[str], kinds: tuple[CellKind, ...], decimal: str, file: str) -> None:
    """Refuse a line above the first row that is probably a faulty row, so that no row is lost."""
    actual = [kind(cell, decimal) for cell in row]
    if _counts(row) or not any(cell in NUMERIC for cell in actual):
        return
    if len(row) == len(kinds):
        cells = zip(row, actual, kinds, strict=True)
        wrong = next(cell for cell, is_, what in cells if what != CellKind.TEXT and is_ not in (what, CellKind.MISSING))
        remedy = f" If this line has the names, set header to {line}." if wrong[:1].isalpha() else ""
        raise InputError(f"{not_a_number(wrong, decimal)}{remedy}", file=file, line=line)
    if 2 * sum(cell in NUMERIC for cell in actual) > len(row):
        message = f"{count(len(row), 'cell')} here, and the rows below have {len(kinds)}"
        raise InputError(f"{message}. Put # before it if it is not a row.", file=file, line=line)


def _check_no_numbers(column: int, cells: Cells, decimal: str, head: Head, file: str) -> None:
    """Refuse a text column whose cells are numbers in another notation."""
    field = (head.names[column] if head.names else "") or f"column {column + 1}"
    for line, row in cells:
        if column < len(row) and (has_thousands(row[column]) or other_decimal(row[column], decimal)):
            raise InputError(not_a_number(row[column], decimal), file=file, line=line, field=field)


def _head(above: Lines, options: Options, delimiter: str, decimal: str, widths: range, file: str) -> Head:
    """Return names and units; their number must match the columns."""
    if options.header == 0:
        return Head()
    if options.header is not None:
        names = name_cells(uncomment(dict(above)[options.header]), delimiter, widths)
        if not names:
            message = f"there are not {widths[-1]} names in this line"
            raise InputError(f"{message}. Give the line that has them, or 0.", file=file, line=options.header)
        line, below = above[-1]
        units = name_cells(uncomment(below), delimiter, widths) if line > options.header else []
        if not units or not is_unit_row(units):
            return Head(tuple(names), (), options.header)
        return Head(tuple(names), units_of(units, len(names)), options.header, line)
    head = find_head(above, delimiter, decimal, widths)
    if not head.names and not head.units and above and delimiter != BLANKS:
        line, text = above[-1]
        row = split_or_whole(text, delimiter)
        numeric = any(kind(cell, decimal) in NUMERIC for cell in row)
        if len(row) > 1 and all(row) and not numeric and len(row) in (widths[0] - 1, widths[-1] + 1):
            message = f"{len(row)} names here, and the rows have {count(widths[-1], 'cell')}"
            raise InputError(f"{message}. Name each column, or set header to 0.", file=file, line=line)
    return head


class TextRows:
    """Converts lines of one table to numbers; the column `names` are for messages, columns of `labels` are texts."""

    def __init__(self, layout: TextLayout, names: list[str], file: str, labels: dict[int, Labels], drop: bool = False):
        self.layout, self.names, self.file = layout, names, file
        self.drop, self.left_out = drop, list[int]()  # lines that are no rows
        self.used = [j for j, what in enumerate(layout.kinds) if what != CellKind.TEXT or j in labels]
        self._texts = layout.clocks | labels
        spare = list(range(layout.width - layout.spare, layout.width))
        self._dtypes = {j: str if j in self._texts else np.float64 for j in self.used + spare}
        self._columns = self.used + spare if CellKind.TEXT in layout.kinds else None  # None: all

    def read(self, raw: bytes, line: int, count: int) -> Piece:
        """Return the rows of `count` whole lines; `line` is the number of the first one. Raises InputError."""
        values = self._by_pandas(raw, count) if self._is_plain(raw, count) else None
        if values is not None:
            return Piece(np.arange(line, line + count), values)
        rows = self._rows(raw.decode(), line)
        values = self._by_pandas("".join(f"{row}\n" for _, row in rows).encode(), len(rows))
        if values is None:
            rows, values = self._cell_by_cell(rows)
        return Piece(np.array([n for n, _ in rows], dtype=np.int64), values)

    def is_row(self, line: str) -> bool:
        """Whether a line is neither blank nor a comment."""
        tabs_count = self.layout.delimiter == "\t" and self.layout.width > 1  # as a row of empty cells
        return bool(line.strip(" " if tabs_count else " \t")) and not line.lstrip().startswith(COMMENT)

    def _is_plain(self, raw: bytes, count: int) -> bool:
        """Whether no line is a comment or has quotation marks, and every line has as many cells as it should."""
        if any(mark.encode() in raw for mark in _MARKS):
            return False
        signs = np.frombuffer(b"\n" + raw, np.uint8)
        marks, each = signs[1:] == ord(self.layout.delimiter), self.layout.width - 1
        if self.layout.delimiter == BLANKS:
            ink = (signs != ord(" ")) & (signs != ord("\t")) & (signs != ord("\n"))
            marks, each = ink[1:] & ~ink[:-1], self.layout.width
        if np.count_nonzero(marks) != each * count:
            return False
        if self._columns is None or each == 0:
            return True  # if a row had too few cells, another would have too many, which pandas refuses
        at, ends = np.flatnonzero(marks), np.flatnonzero(signs[1:] == ord("\n"))
        return bool(np.all(at[each - 1 :: each] < ends) and np.all(at[each::each] > ends[:-1]))

    def _rows(self, text: str, line: int) -> Lines:
        """Return the lines that are rows; InputError where the cells are too many or few."""
        delimiter, width = self.layout.delimiter, self.layout.width
        rows = []
        for n, row in enumerate(text.split("\n"), line):
            if not self.is_row(row):
                continue
            try:
                cells = len(split(row, delimiter))
                if cells != width:
                    remedy = "write repair: {rows: drop} in a sheet to leave such lines out, or put # before it"
                    raise ValueError(f"{count(cells, 'cell')} here, {width} expected. Correct this line, or {remedy}.")
            except ValueError as error:
                if not self.drop:
                    raise InputError(str(error), file=self.file, line=n) from None
                self.left_out.append(n)
                continue
            rows.append((n, row))
        return rows

    def _by_pandas(self, raw: bytes, count: int) -> np.ndarray | None:
        """Return the values of `count` rows, or None where pandas finds anything but numbers and date-times."""
        delimiter, width = self.layout.delimiter, self.layout.width
        # a column of nothing but True and False would pass for numbers; a first row of zeros prevents that
        zeros = delimiter.join("0" * width).encode() + b"\n"
        for blanks_first in (b'"' in raw, True):  # slower, and needed before quotation marks and missing values only
            try:
                frame = _READ_CSV(
                    io.BytesIO(zeros + raw),
                    sep=r"\s+" if delimiter == BLANKS else delimiter,
                    decimal=self.layout.decimal,
                    header=None,
                    names=range(width),
                    index_col=False,
                    usecols=self._columns,
                    dtype=self._dtypes,
                    na_values=sorted(MISSING),
                    keep_default_na=False,
                    skipinitialspace=blanks_first,
                    low_memory=False,
                    **_NEAREST,
                )
                for j, texts in self._texts.items():
                    frame[j] = np.concatenate([[0.0], texts.numbers(frame[j].iloc[1:])])
            except ValueError:
                continue
            values = frame.to_numpy(np.float64)[1:]
            if len(values) != count or not np.all(np.isnan(values[:, len(self.used) :])):
                return None
            return values[:, : len(self.used)]
        return None

    def _cell_by_cell(self, rows: Lines) -> tuple[Lines, np.ndarray]:
        """Rows and their values. Raises InputError at the first cell that has none, unless such rows are left out."""
        there, values = Lines(), list[list[float]]()
        for n, row in rows:
            try:
                values.append(self._numbers(n, row))
                there.append((n, row))
            except InputError:
                if not self.drop:
                    raise
                self.left_out.append(n)
        return there, np.array(values).reshape(-1, len(self.used))

    def _numbers(self, line: int, row: str) -> list[float]:
        cells, values = split(row, self.layout.delimiter), list[float]()
        for j in self.used:
            try:
                values.append(self._value(cells[j], j))
            except ValueError as error:
                raise InputError(str(error), file=self.file, line=line, field=self.names[j]) from None
        for beyond in filter(None, cells[self.layout.width - self.layout.spare :]):
            message = f'"{shorten(beyond)}" stands behind the last column. Name its column, or delete it.'
            raise InputError(message, file=self.file, line=line)
        return values

    def _value(self, cell: str, column: int) -> float:
        if column in self._texts and cell not in MISSING:
            return self._texts[column].number(cell)
        return number(cell, self.layout.decimal)

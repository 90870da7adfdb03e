"""Excel workbooks: their worksheets row by row, and the table of one worksheet as a TableSource."""

import re
import warnings
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO, Any
from zipfile import ZipFile

import numpy as np

from nectosome.measure.formats.headings import Labels, distinct
from nectosome.measure.formats.source import Options, Piece, TableSource
from nectosome.measure.formats.worksheet import UNCALCULATED, Merged, Row, SheetLayout, TablePlace, kind, lay_out
from nectosome.units import InputError, did_you_mean, shorten

from .file_errors import check_columns, check_memory, damage_as_input_error, first_bytes, wrong_format

ENDINGS = ".xlsx", ".xlsm"

_LAST = 2**20  # row of a worksheet
_BATCH = 1000  # rows
_MARK = re.compile(rb'<(?:\w+:)?(?:(f)[\s>/]|mergeCell\s[^>]*?ref="([^"]+)")')
_OVERLAP = 200  # bytes, longer than a mark
_TOP = 200  # rows within which the table must begin
_CELLS = 100_000  # that are looked at for it


@dataclass(frozen=True)
class Worksheet:
    """Whether a worksheet has formulas, and its merged cells; openpyxl does not give these of a streamed one."""

    formulas: bool
    merged: tuple[Merged, ...]


class Book:
    """A workbook, opened once for its values, and a second time for formulas if a worksheet has any."""

    def __init__(self, path: Path):
        self._path, self._files = path, ExitStack()
        self._values, self._formulas = self._load(values=True), None
        self._sheets: dict[str, Worksheet] = {}
        self.titles = [sheet.title for sheet in self._values.worksheets]

    def close(self) -> None:
        """Close the file."""
        self._files.close()

    def sheet(self, title: str) -> Worksheet:
        """Return what the XML of a worksheet says of it."""
        if title not in self._sheets:
            with self._values._archive.open(self._values[title]._worksheet_path) as xml:
                self._sheets[title] = _scan(xml)
        return self._sheets[title]

    def rows(self, title: str) -> Iterator[tuple[int, Row]]:
        """Yield all rows of a worksheet with their numbers, from 1, empty ones included."""
        numbered = enumerate(
            self._with_formulas(title) if self.sheet(title).formulas else _rows(self._values[title]), 1
        )
        while True:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # about cell formats
                batch = list(islice(numbered, _BATCH))
            if not batch:
                return
            if batch[-1][0] > _LAST:
                raise ValueError("more rows than a worksheet has")
            yield from batch

    def _with_formulas(self, title: str) -> Iterator[Row]:
        """Rows with UNCALCULATED for each formula without a value."""
        self._formulas = self._formulas or self._load(values=False)
        values = self._values[title]
        values.reset_dimensions()
        for row, formulas in zip(values.iter_rows(), _rows(self._formulas[title]), strict=True):
            yield [
                UNCALCULATED if cell.value is None and formula is not None and cell.data_type != "str" else cell.value
                for cell, formula in zip(row, formulas, strict=True)  # "str": a formula with an empty text as its value
            ]

    def _load(self, values: bool) -> Any:
        from openpyxl import load_workbook

        with ExitStack() as stack, warnings.catch_warnings():
            warnings.simplefilter("ignore")
            file = stack.enter_context(self._path.open("rb"))
            book = load_workbook(file, read_only=True, data_only=values, keep_links=False)
            self._files.push(stack.pop_all())
            return book


def _rows(sheet: Any) -> Iterator[Row]:
    sheet.reset_dimensions()  # some programs write wrong dimensions, and openpyxl would stop there
    return sheet.iter_rows(values_only=True)


def _scan(xml: IO[bytes]) -> Worksheet:
    from openpyxl.utils import range_boundaries

    formulas, refs, tail = False, dict[str, None](), b""
    while step := xml.read(2**20):
        text = tail + step
        for mark in _MARK.finditer(text):
            formulas = formulas or mark[1] is not None
            if mark[2] is not None:
                refs[mark[2].decode("ascii")] = None  # matches in the overlap occur twice
        tail = text[-_OVERLAP:]
    merged: list[Any] = [range_boundaries(ref) for ref in refs]
    return Worksheet(formulas, tuple(Merged(top, left, bottom, right) for left, top, right, bottom in merged))


def open_excel(path: Path, options: Options) -> TableSource:
    """Open a workbook (.xlsx, .xlsm): its only worksheet with rows of numbers, or the one that `options.table` names.

    Raises InputError for another format, a damaged file, and no such worksheet or several.
    """
    start = first_bytes(path)
    if not start.startswith(b"PK\x03\x04"):
        raise wrong_format(path, "an Excel workbook (.xlsx)", start)
    with damage_as_input_error(path), ExitStack() as stack:
        with ZipFile(path) as archive:
            members = {member.filename: member.file_size for member in archive.infolist()}
        check_memory(members.values(), options.memory)
        # worksheets are read row by row, all else as a whole, and takes several times as much as in the file
        whole = (size for name, size in members.items() if "/worksheets/" not in name)
        check_memory(whole, options.memory, "its texts hold when they are unpacked", share=1 / 8)
        if "xl/workbook.bin" in members:
            raise InputError("this is a binary workbook (.xlsb). Save it as .xlsx.")
        if "[Content_Types].xml" not in members:
            raise wrong_format(path, "an Excel workbook (.xlsx)", start)
        book = Book(path)
        stack.callback(book.close)
        source = ExcelSource(path, book, *_choose(book, options))
        stack.pop_all()
        return source


def _choose(book: Book, options: Options) -> tuple[str, SheetLayout]:
    """The title of the worksheet with the table, and the position of the table."""
    if options.table is not None and options.table not in book.titles:
        name = shorten(options.table)
        raise InputError(f'there is no worksheet called "{name}".{did_you_mean(name, book.titles)}')
    titles = book.titles if options.table is None else [options.table]
    top = _TOP + (options.header or 0)
    layouts: dict[str, SheetLayout] = {}
    for title in titles:
        rows, cells = list[Row](), 0
        for _, row in islice(book.rows(title), top):
            check_columns(len(row))
            rows.append(row)
            cells += len(row)
            if cells > _CELLS:
                break
        layout = lay_out(rows, options, book.sheet(title).merged)
        if layout is not None:
            layouts[title] = layout
    if not layouts:
        below = f"below names in row {options.header}" if options.header else f"in the first {top} rows"
        where = f"{below} of {', '.join(titles)}"
        raise InputError(f"there are no rows of numbers {where}. Numbers stored as text do not count.")
    if len(layouts) > 1:
        first = next(iter(layouts))
        listed = ", ".join(layouts)
        choose = f'Choose one in a sheet, as in file: {{table: "{first}"}}.'
        raise InputError(f"has several worksheets with numbers: {listed}. {choose}")
    return layouts.popitem()


class ExcelSource(TableSource):
    """The table of a worksheet; Piece.rows are the rows of the sheet."""

    reader = "excel"

    def __init__(self, path: Path, book: Book, title: str, layout: SheetLayout):
        self.columns = distinct(place.column for place in layout.places)
        self.left_out = {index + 1: (name, "text") for index, name in layout.texts.items()}
        self.found = (f"worksheet: {title}", *layout.found)
        self.repairs: list[str] = []
        self._path, self._book, self._title, self._layout = path, book, title, layout
        self.labels = next((p.texts.texts for p in layout.places if isinstance(p.texts, Labels)), None)
        self._indices = {place.index for place in layout.places}
        self._dense = next(i for i in range(len(self._indices) + 1) if i not in self._indices)
        self._refuse_merged()

    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield all rows that are not empty in the columns of the table; `repairs` lists what else is below it."""
        numbered = self._numbered()
        while True:
            with damage_as_input_error(self._path):
                batch = list(islice(numbered, rows))
            if not batch:
                return
            yield Piece(np.array([n for n, _ in batch]), np.array([values for _, values in batch]))

    def close(self) -> None:
        """Close the file."""
        self._book.close()

    def _numbered(self) -> Iterator[tuple[int, list[float]]]:
        empty: list[int] = []
        for number, row in self._book.rows(self._title):
            if number < self._layout.first:
                continue
            self._check_beside(number, row)
            if all(p.index >= len(row) or kind(row[p.index]) == "empty" for p in self._layout.places):
                empty.append(number)
                continue
            if empty:
                self._note(f"row {empty[0]}: rows that are empty in the columns of the table are left out.")
            yield number, [self._number(number, row, place) for place in self._layout.places]

    def _number(self, number: int, row: Row, place: TablePlace) -> float:
        try:
            return place.number(row[place.index] if place.index < len(row) else None)
        except (ValueError, OverflowError) as error:
            raise self._error(number, place.index, f"{error}.") from None

    def _check_beside(self, number: int, row: Row) -> None:
        """Note text beside the table in `repairs`; refuse numbers there."""
        if len(row) <= self._dense:
            return
        for index, cell in enumerate(row):
            what = kind(cell) if index not in self._indices else "empty"
            if what in ("number", "time"):
                raise self._error(number, index, f"{cell} is beside the table. Empty the cell, or name its column.")
            if what == "text" and index not in self._layout.texts:
                self._note(f'row {number}: "{shorten(cell)}" beside the table is left out.')

    def _refuse_merged(self) -> None:
        for top, left, bottom, right in self._book.sheet(self._title).merged:
            for index in sorted(self._indices):
                if bottom >= self._layout.first and left <= index + 1 <= right:
                    what = "one number cannot be in several cells. Unmerge them, and fill each"
                    raise self._error(max(top, self._layout.first), index, f"the cells are merged, and {what}.")

    def _error(self, number: int, index: int, message: str) -> InputError:
        from openpyxl.utils import get_column_letter

        name = next((p.column.name for p in self._layout.places if p.index == index), "")
        field = f"column {get_column_letter(index + 1)}{f' ({name})' if name else ''}"
        return InputError(message, file=str(self._path), line=number, field=field)

    def _note(self, sentence: str) -> None:
        if sentence not in self.repairs:  # pieces may be read repeatedly
            self.repairs.append(sentence)

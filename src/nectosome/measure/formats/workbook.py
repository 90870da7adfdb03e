"""An opened workbook: the rows of its worksheets, one after another, formulas by the values that they last had."""

import re
import warnings
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import IO, Any

from nectosome.measure.formats.cells import UNCALCULATED
from nectosome.measure.formats.worksheet import Merged, Row

_LAST = 2**20  # row of a worksheet
_BATCH = 1000  # rows
_MARK = re.compile(rb'<(?:\w+:)?(?:(f)[\s>/]|mergeCell\s[^>]*?ref="([^"]+)")')
_OVERLAP = 200  # bytes, longer than a mark


@dataclass(frozen=True)
class Sheet:
    """What openpyxl does not tell of a worksheet that it streams: whether it has formulas, and its merged cells."""

    formulas: bool
    merged: tuple[Merged, ...]


class Book:
    """A workbook, opened once for its values and, where a worksheet has formulas, once for those."""

    def __init__(self, path: Path):
        self._path, self._files = path, ExitStack()
        self._values, self._formulas = self._load(values=True), None
        self._sheets: dict[str, Sheet] = {}
        self.titles = [sheet.title for sheet in self._values.worksheets]

    def close(self) -> None:
        """Let go of the file."""
        self._files.close()

    def sheet(self, title: str) -> Sheet:
        """Look through the text of a worksheet."""
        if title not in self._sheets:
            with self._values._archive.open(self._values[title]._worksheet_path) as xml:
                self._sheets[title] = _look_through(xml)
        return self._sheets[title]

    def rows(self, title: str) -> Iterator[tuple[int, Row]]:
        """The rows of a worksheet with their numbers, from 1; empty ones as well."""
        numbered = enumerate(
            self._with_formulas(title) if self.sheet(title).formulas else _rows(self._values[title]), 1
        )
        while True:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")  # of formats that are not for reading
                batch = list(islice(numbered, _BATCH))
            if not batch:
                return
            if batch[-1][0] > _LAST:
                raise ValueError("more rows than a worksheet has")
            yield from batch

    def _with_formulas(self, title: str) -> Iterator[Row]:
        """Rows in which a formula without a value is told."""
        self._formulas = self._formulas or self._load(values=False)
        values = self._values[title]
        values.reset_dimensions()
        for row, formulas in zip(values.iter_rows(), _rows(self._formulas[title]), strict=True):
            yield [
                UNCALCULATED if cell.value is None and formula is not None and cell.data_type != "str" else cell.value
                for cell, formula in zip(row, formulas, strict=True)  # "str": a formula that gives an empty text
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
    sheet.reset_dimensions()  # some programs write wrong ones, and openpyxl would stop there
    return sheet.iter_rows(values_only=True)


def _look_through(xml: IO[bytes]) -> Sheet:
    from openpyxl.utils import range_boundaries

    formulas, refs, tail = False, dict[str, None](), b""
    while step := xml.read(2**20):
        text = tail + step
        for mark in _MARK.finditer(text):
            formulas = formulas or mark[1] is not None
            if mark[2] is not None:
                refs[mark[2].decode("ascii")] = None  # those in the overlap are seen twice
        tail = text[-_OVERLAP:]
    merged: list[Any] = [range_boundaries(ref) for ref in refs]
    return Sheet(formulas, tuple(Merged(top, left, bottom, right) for left, top, right, bottom in merged))

"""Rows of a text as numbers: pandas reads them, and what it does not take is looked at cell by cell."""

import io
from typing import Any

import numpy as np
import pandas as pd

from nectosome.io.errors import InputError, shorten
from nectosome.measure.formats.source import Piece
from nectosome.measure.formats.text_cells import BLANKS, COMMENT, MISSING, Kind, count_cells, moment, number, split
from nectosome.measure.formats.text_layout import Layout, Lines

_SECOND = np.timedelta64(1, "s")
_MARKS = ('"', *COMMENT)

_READ_CSV: Any = pd.read_csv  # its annotations know neither names by range nor types by place


class Rows:
    """Turns lines of one table into numbers; `names` of the columns are for messages."""

    def __init__(self, layout: Layout, names: list[str], file: str):
        self.layout, self.names, self.file = layout, names, file
        self.used = [j for j, what in enumerate(layout.kinds) if what != Kind.TEXT]
        self._starts = {j: self._start(j) for j in layout.moments}
        spare = list(range(layout.width - layout.spare, layout.width))
        self._dtypes = {j: str if j in self._starts else np.float64 for j in self.used + spare}
        self._columns = self.used + spare if Kind.TEXT in layout.kinds else None  # None: all

    def read(self, raw: bytes, line: int, count: int) -> Piece:
        """Return the rows of so many whole lines, of which the first is `line` of the file. Raises InputError."""
        values = self._by_pandas(raw, count) if self._is_plain(raw, count) else None
        if values is not None:
            return Piece(np.arange(line, line + count), values)
        rows = self._rows(raw.decode(), line)
        values = self._by_pandas("".join(f"{row}\n" for _, row in rows).encode(), len(rows))
        if values is None:
            values = self._cell_by_cell(rows)
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
                count = len(split(row, delimiter))
            except ValueError as error:
                raise InputError(str(error), file=self.file, line=n) from None
            if count != width:
                said = f"{count_cells(count)} here, {width} expected"
                way_out = "Correct this line, or put # before it to leave it out."
                raise InputError(f"{said}. {way_out}", file=self.file, line=n)
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
                )
                for j, start in self._starts.items():
                    frame[j] = _seconds(frame[j].iloc[1:], start)
            except ValueError:
                continue
            values = frame.to_numpy(np.float64)[1:]
            if len(values) != count or not np.all(np.isnan(values[:, len(self.used) :])):
                return None
            return values[:, : len(self.used)]
        return None

    def _cell_by_cell(self, rows: Lines) -> np.ndarray:
        """Return the values of the rows, or raise InputError at the first cell that has none."""
        values = np.empty((len(rows), len(self.used)))
        for i, (n, row) in enumerate(rows):
            cells = split(row, self.layout.delimiter)
            for k, j in enumerate(self.used):
                try:
                    values[i, k] = self._value(cells[j], j)
                except ValueError as error:
                    raise InputError(str(error), file=self.file, line=n, field=self.names[j]) from None
            beyond = next((cell for cell in cells[self.layout.width - self.layout.spare :] if cell), None)
            if beyond is not None:
                said = f'"{shorten(beyond)}" stands behind the last column'
                raise InputError(f"{said}. Name its column, or delete it.", file=self.file, line=n)
        return values

    def _start(self, column: int) -> pd.Timestamp:
        try:
            return moment(self.layout.moments[column])
        except ValueError as error:
            raise InputError(str(error), file=self.file, field=self.names[column]) from None

    def _value(self, cell: str, column: int) -> float:
        if column in self._starts and cell not in MISSING:
            return (moment(cell) - self._starts[column]) / _SECOND
        return number(cell, self.layout.decimal)


def _seconds(times: pd.Series, start: pd.Timestamp) -> pd.Series:
    """Return date-times as seconds since the start, nan where they are missing; ValueError where one is none."""
    if (times.str.len() < len("2024-01-01 00:00")).any():  # a year alone would pass, too
        raise ValueError
    since = pd.to_datetime(times, format="ISO8601", utc=True) - start
    return since / _SECOND

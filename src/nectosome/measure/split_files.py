"""A file with several recordings one below the other: its rows apart, by a column that says which one they are of."""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from nectosome.units import InputError, count, shorten

from .channels import column_index
from .formats.file_errors import check_memory, damage_as_input_error
from .formats.source import Piece, TableSource
from .sheet import Split

_MOST = 1000  # parts of a file
_LISTED = 8


class FilePart(TableSource):
    """Rows of a file of which one column says the same; the column itself is not among its columns."""

    def __init__(self, source: TableSource, index: int, label: str, pieces: Sequence[Piece]):
        column = source.columns[index]
        self.reader, self.rate, self.repairs, self.label = source.reader, source.rate, source.repairs, label
        self.columns = (*source.columns[:index], *source.columns[index + 1 :])
        self.left_out = {**source.left_out, column.place: (column.name, "what the file is split by")}
        rows = f"rows {pieces[0].rows[0]} to {pieces[-1].rows[-1]}"
        self.found = (*source.found, f"split by {column.name}: {label}, {rows}")
        self._pieces = pieces

    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield all rows as they were read."""
        yield from self._pieces

    def close(self) -> None:
        """Do nothing: the file is closed by itself."""


def parts_of(source: TableSource, split: Split, file: str, rows: int, memory: int) -> list[FilePart]:
    """The parts of a file, in its order, or the one of `split.value`; read `rows` at a time, and kept in memory.

    Raises InputError that names the row for a missing value, rows of one value that are not together, and for more
    than 1000 parts, and where there is no such column or value, or the file is larger than `memory` [bytes].
    """
    texts = {*source.left_out} | {name for name, _ in source.left_out.values()}
    if split.column in texts:
        why = (
            f'the column "{shorten(split.column)}" is no numbers, and only text files and worksheets are split by text'
        )
        raise InputError(f"{why}. Save it as .csv.", file=file, field="split")
    index = column_index(source, split.column, "split", file)
    name = shorten(source.columns[index].name)
    by_code: dict[float, list[Piece]] = {}
    last, size = np.nan, 0
    for piece in source.pieces(rows):
        size += piece.values.nbytes
        with damage_as_input_error(Path(file)):
            check_memory([size], memory, "the first rows of a file that is split hold")
        codes = piece.values[:, index]
        if np.isnan(codes).any():
            line = int(piece.rows[np.isnan(codes)][0])
            raise InputError("has no value in this row.", file=file, line=line, field=name)
        edges = np.flatnonzero(np.diff(codes)) + 1
        for start, stop in zip([0, *edges], [*edges, len(codes)], strict=True):
            code, line = float(codes[start]), int(piece.rows[start])
            if code != last and code in by_code:
                before = int(by_code[code][-1].rows[-1])
                why = f'rows with "{shorten(_text(source, code))}" are not together: they go on here after row {before}'
                raise InputError(f"{why}. Sort the file by {name}.", file=file, line=line, field=name)
            if code not in by_code and len(by_code) == _MOST:
                why = f"has more than {_MOST} values. Is it the column that says which recording a row is of?"
                raise InputError(why, file=file, field=name)
            values = np.delete(piece.values[start:stop], index, axis=1)
            by_code.setdefault(code, []).append(Piece(piece.rows[start:stop], values))
            last = code
    parts = [FilePart(source, index, _text(source, code), pieces) for code, pieces in by_code.items()]
    if split.value is None:
        return parts
    chosen = [part for part in parts if part.label == split.value]
    if not chosen:
        labels = [shorten(part.label, 40) for part in parts]
        listed = ", ".join(labels[:_LISTED]) + (f" and {len(labels) - _LISTED} more" if len(labels) > _LISTED else "")
        why = f'there is no "{shorten(split.value)}". {count(len(labels), "value")}: {listed}.'
        raise InputError(why, file=file, field=name)
    return chosen


def _text(source: TableSource, code: float) -> str:
    return source.labels[int(code)] if source.labels is not None else f"{code:.15g}"

"""Columns of arrays in a file: an array that can be sliced by rows becomes columns of floats, piece by piece."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np
from numpy.typing import DTypeLike

from nectosome.measure.formats.file_errors import damage_as_input_error
from nectosome.measure.formats.headings import distinct, split_known_unit
from nectosome.measure.formats.source import Column, Piece, TableSource
from nectosome.units import InputError

_EXACT = 2**53  # up to this, every integer is a float


class ArrayRows(Protocol):
    """An array that can be sliced by rows: of NumPy, of h5py, or of a reader."""

    @property
    def shape(self) -> tuple[int, ...]:
        """Rows first."""
        ...

    @property
    def dtype(self) -> np.dtype[Any]:
        """Type of its elements."""
        ...

    def __getitem__(self, rows: slice, /) -> np.ndarray:
        """Return these rows."""
        ...


class LazyArray:
    """An array whose rows are read when they are used."""

    def __init__(self, shape: tuple[int, ...], dtype: DTypeLike, read: Callable[[Any], np.ndarray]):
        self.shape, self.dtype, self._read = shape, np.dtype(dtype), read

    def __getitem__(self, rows: Any) -> np.ndarray:
        return self._read(rows)


def refusal(dtype: np.dtype[Any]) -> str:
    """Return what an array of this type, or all of its fields, holds instead of numbers; "" if it holds numbers."""
    if dtype.names is not None:
        return "no numbers" if all(refusal(leaf) for _, leaf in _leaves(dtype)) else ""
    base = dtype.base
    if base.kind in "biuf":
        return "" if base.itemsize <= 8 else "numbers of more than 64 bits"
    words = {"c": "complex numbers", "O": "objects", "S": "text", "U": "text", "T": "text", "M": "", "m": ""}
    return words.get(base.kind, "data of an unknown type")


class RowBlock:
    """An array as columns of floats: one, several, or one per field.

    Date-times become seconds since the first one, booleans 0 and 1, integers beyond 2^53 the nearest float.
    """

    def __init__(
        self,
        name: str,
        array: ArrayRows,
        unit: str = "",
        labels: Sequence[str] = (),
        whole: bool = True,
        place: int = 1,
        start: str = "",
    ):
        """`labels` name the columns of a matrix; `whole`: fields have no prefix `name`.

        `place` is that of its first column among those of the file, from 1; 0 for a computed column. `start` is the
        date and time of its zero, if it is a time.
        """
        self.rows, self.left_out = array.shape[0], dict[int, tuple[str, str]]()
        self.found: list[str] = []
        self._array, self._parts = array, list[_Part]()
        for path, dtype in _leaves(array.dtype):
            if refusal(dtype):
                refused = ".".join((name, *path)) if name else ".".join(path)
                self.found.append(f"left out: {refused} ({refusal(dtype)})")
                self.left_out[place] = refused, refusal(dtype)
                place += 1
                continue
            title = ".".join(path) if path and whole else ".".join((name, *path))
            shape = (*array.shape[1:], *dtype.shape)
            names = [_title(title, i, labels if not path else ()) for i in np.ndindex(shape)]
            origin = self._origin(path, dtype.base, names[0])
            kept = "s" if dtype.base.kind in "mM" else unit
            start = start if origin is None else str(origin)
            places = range(place, place + len(names)) if place else [0] * len(names)
            columns = [Column(n, kept, n, k, start) for n, k in zip(names, places, strict=True)]
            place += len(names) if place else 0
            self._parts.append(_Part(path, [split_known_unit(column) for column in columns], origin))
        self.columns = [column for part in self._parts for column in part.columns]

    def read(self, start: int, stop: int, tell: Callable[[str], None]) -> np.ndarray:
        """Return the rows `start` to `stop` - 1 as floats; `tell` receives the repairs."""
        rows = self._array[start:stop]
        if len(rows) != stop - start:
            raise ValueError("fewer rows than the shape says")
        return np.concatenate([part.floats(rows, start, tell) for part in self._parts], axis=1)

    def _origin(self, path: tuple[str, ...], dtype: np.dtype[Any], name: str) -> np.datetime64 | None:
        if dtype.kind != "M":
            return None
        first = np.ravel(_at(self._array[0:1], path))[0]
        if np.isnat(first):
            raise InputError("the first time is missing; the others are relative to it.", field=name)
        self.found.append(f"{name}: seconds since {first}")
        return first


class _Part:
    """The columns of one field of an array, or of the array itself."""

    def __init__(self, path: tuple[str, ...], columns: list[Column], origin: np.datetime64 | None):
        self.path, self.origin = path, origin
        self._rounded: set[int] = set()  # columns already reported
        self.columns = columns

    def floats(self, rows: np.ndarray, start: int, tell: Callable[[str], None]) -> np.ndarray:
        values = _at(rows, self.path).reshape(len(rows), len(self.columns))
        if self.origin is not None:
            values = values - self.origin
        if values.dtype.kind == "m":
            return values / np.timedelta64(1, "s")
        if values.dtype.kind in "iu" and values.dtype.itemsize == 8:
            beyond = (values > _EXACT) | (values < -_EXACT if values.dtype.kind == "i" else False)
            for column in set(np.flatnonzero(beyond.any(axis=0)).tolist()) - self._rounded:
                row = start + int(beyond[:, column].argmax()) + 1
                tell(f"{self.columns[column].name}: integers beyond 2^53 are rounded to floats, from row {row} on.")
                self._rounded.add(column)
        return values.astype(float)


class ArraySource(TableSource):
    """A table of blocks of equal length."""

    def __init__(
        self,
        reader: str,
        path: Path,
        blocks: Sequence[RowBlock],
        found: Sequence[str],
        repairs: Sequence[str] = (),
        close: Callable[[], object] = lambda: None,
        left_out: Mapping[int, tuple[str, str]] = MappingProxyType({}),
    ):
        self.reader, self.repairs = reader, list(repairs)
        self.columns = distinct(column for block in blocks for column in block.columns)
        self.found = (*found, *(phrase for block in blocks for phrase in block.found))
        self.left_out = dict(left_out) | {k: what for block in blocks for k, what in block.left_out.items()}
        self._path, self._blocks, self._close = path, list(blocks), close

    def pieces(self, rows: int) -> Iterator[Piece]:
        """Yield all rows in order; Piece.rows are sample numbers, from 1."""
        length = self._blocks[0].rows
        for start in range(0, length, rows):
            stop = min(start + rows, length)
            with damage_as_input_error(self._path, f" from row {start + 1} on"):
                values = np.concatenate(
                    [block.read(start, stop, self.repairs.append) for block in self._blocks], axis=1
                )
            yield Piece(np.arange(start + 1, stop + 1), values)

    def close(self) -> None:
        """Close the file."""
        self._close()


def _leaves(dtype: np.dtype[Any], path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, ...], np.dtype[Any]]]:
    """The path and type of each field of a record type; a plain type is one field without a name."""
    if dtype.names is None:
        yield path, dtype
        return
    for name in dtype.names:
        yield from _leaves(dtype[name], (*path, name))


def width(array: ArrayRows) -> int:
    """Return the number of columns of an array, those of text as well."""
    leaves = [dtype for _, dtype in _leaves(array.dtype)]
    return sum(1 if refusal(d) else int(np.prod((*array.shape[1:], *d.shape))) for d in leaves)


def _at(rows: np.ndarray, path: tuple[str, ...]) -> np.ndarray:
    for name in path:
        rows = rows[name]
    return rows


def _title(name: str, index: tuple[int, ...], labels: Sequence[str]) -> str:
    if not name and labels and len(index) == 1:
        return labels[index[0]]
    if not name:
        return f"column {index[0] + 1 if index else 1}"
    if len(index) == 1 and labels:
        return f"{name}[{labels[index[0]]}]"
    return f"{name}[{','.join(map(str, index))}]" if index else name

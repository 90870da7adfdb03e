"""Tables of a file of named arrays: its entries, and the choice of arrays of one group and one length."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from nectosome.measure.formats.arrays import ArrayRows, LazyArray, RowBlock, refusal, width
from nectosome.measure.formats.file_errors import check_columns
from nectosome.measure.formats.headings import is_time
from nectosome.units import InputError, count, did_you_mean, shorten

_BESIDE = 10  # ratio from which a shorter table is auxiliary data, and a wider matrix has its samples along its rows


@dataclass(frozen=True)
class NamedArray:
    """A vector or matrix of numbers with a name, samples first."""

    name: str
    array: ArrayRows
    unit: str = ""
    labels: Sequence[str] = ()  # of the columns of a matrix
    group: str = ""  # "" at the top
    along: str = ""  # dimension or sampling interval of the samples, if the file names one
    first: bool = False  # a coordinate
    notes: Sequence[str] = ()
    computed: bool = False  # not a column of the file
    start: str = ""  # date and time of its zero, in UTC

    @property
    def path(self) -> str:
        """Group and name."""
        return join(self.group, self.name)

    @property
    def is_vector(self) -> bool:
        """Whether it is one column."""
        return len(self.array.shape) == 1 and self.array.dtype.names is None


@dataclass(frozen=True)
class SkippedEntry:
    """An entry that is not a column of numbers."""

    name: str
    what: str  # "text", "complex numbers", "scalar"
    group: str = ""
    value: str = ""  # as text, if it is short
    rows: int = 0  # of a column of text; 0 for what is no column

    def __str__(self) -> str:
        value = f" = {self.value}" if self.value else ""
        return f"{shorten(join(self.group, self.name))}{value} ({self.what})"


def join(group: str, name: str) -> str:
    """Return the path of a name in a group."""
    return f"{group}/{name}" if group else name or "the array"


def classify(name: str, array: Any, group: str = "", **more: Any) -> NamedArray | SkippedEntry:
    """Return an array of a file as a vector or matrix with `more` fields, or as a skipped entry with the reason."""
    shape = tuple(array.shape)
    what = refusal(array.dtype)
    if array.dtype.names is None and what in ("", "text") and int(np.prod(shape)) == 1:
        single = _decoded(np.asarray(array[0:1] if len(shape) == 1 else array[(0,) * len(shape)]).item())
        value = f'"{shorten(single)}"' if isinstance(single, str) else shorten(single).removesuffix(".0")
        return SkippedEntry(name, what or "scalar", group, value)
    if not what and (0 in shape or not shape):
        what = "empty" if shape else "one record"
    if not what and len(shape) > 2:
        what = f"{len(shape)} dimensions"
    if what:
        return SkippedEntry(name, what, group, rows=max(shape) if int(np.prod(shape)) == max(shape, default=0) else 0)
    if len(shape) == 2 and 1 in shape:
        is_row, matrix = shape[0] == 1, array
        array = LazyArray((max(shape),), matrix.dtype, lambda rows: matrix[0, rows] if is_row else matrix[rows, 0])
    return NamedArray(name, array, group=group, **more)


def text(attribute: Any) -> str:
    """Return an attribute as text; "" if it is not text."""
    values = np.ravel(attribute)
    first = _decoded(values[0]) if len(values) == 1 else None
    return first.strip() if isinstance(first, str) else ""


def _decoded(value: Any) -> Any:
    return value.decode("utf-8", "replace") if isinstance(value, bytes) else value


class Transposed(LazyArray):
    """A matrix whose samples run along its rows, transposed."""

    def __init__(self, array: Any):
        super().__init__(array.shape[::-1], array.dtype, lambda rows: array[:, rows].T)


@dataclass
class ArrayTable:
    """Arrays of one group, one length and one dimension; `found`: notes, and what was left out."""

    group: str
    rows: int
    along: str
    items: list[NamedArray]
    found: list[str] = field(default_factory=list)
    places: dict[str, int] = field(default_factory=dict)  # of the first column of each array, by its path
    left_out: dict[int, tuple[str, str]] = field(default_factory=dict)  # columns of text, by place

    def __str__(self) -> str:
        names = shorten(", ".join(join(self.group, item.name) for item in self.items))
        return f"{names} ({count(self.rows, 'row')}{', ' if self.along else ''}{self.along})"

    def blocks(self) -> list[RowBlock]:
        """The arrays as columns, coordinates first. Raises InputError for too many columns."""
        check_columns(sum(width(item.array) for item in self.items))
        items = sorted(self.items, key=lambda item: not item.first)
        whole = len(items) == 1
        return [
            RowBlock(item.name, item.array, item.unit, item.labels, whole, self.places.get(item.path, 0), item.start)
            for item in items
        ]

    def count_places(self, entries: "Sequence[NamedArray | SkippedEntry]") -> None:
        """Count the columns of the table in the order of the file, columns of text as well."""
        place, items = 1, {item.path: item for item in self.items}
        for entry in entries:
            if isinstance(entry, NamedArray) and entry.path in items and not entry.computed:
                self.places[entry.path] = place
                place += width(items[entry.path].array)
            elif isinstance(entry, SkippedEntry) and (entry.group, entry.rows) == (self.group, self.rows):
                self.left_out[place] = entry.name, entry.what
                place += 1


def choose(entries: Sequence[NamedArray | SkippedEntry], name: str | None, beside: bool = True) -> ArrayTable:
    """Return the table: the one with `name` (a group, an array), else the only one. Raises InputError that lists them.

    With `beside`, the table of a group with several lengths is the one with the time, or the far longest one.
    """
    items = _samples_first([entry for entry in entries if isinstance(entry, NamedArray)])
    others = [entry for entry in entries if isinstance(entry, SkippedEntry)]
    together: dict[tuple[str, int, str], ArrayTable] = {}
    for item in items:
        key = item.group, item.array.shape[0], item.along
        together.setdefault(key, ArrayTable(*key, items=[])).items.append(item)
    tables = list(together.values())
    if not tables:
        inside = f" Inside: {'; '.join(str(other) for other in others[:8])}." if others else ""
        raise InputError(f"holds no columns of numbers.{inside}")
    if name is not None:
        table = _named(tables, name.strip("/"), others, beside)
    else:
        groups = {table.group: [t for t in tables if t.group == table.group] for table in tables}
        table = _main(tables, beside and len(groups) == 1)
    within = {item.path for item in table.items}
    rest = [f"left out: {t}" for t in tables if not within & {item.path for item in t.items}]
    transposed = [f"{i.path}: its rows taken as columns" for i in table.items if isinstance(i.array, Transposed)]
    notes = [note for item in table.items for note in item.notes]
    table = replace(table, found=[*transposed, *notes, *rest, *(f"left out: {other}" for other in others)])
    table.count_places(entries)
    return table


def _samples_first(items: Sequence[NamedArray]) -> list[NamedArray]:
    """Transpose matrices with samples along rows: as wide as a vector of the group is long, or far wider than tall."""
    lengths = {(item.group, item.array.shape[0]) for item in items if item.is_vector}

    def is_transposed(item: NamedArray) -> bool:
        if item.is_vector or item.along or item.array.dtype.names is not None:
            return False
        rows, columns = item.array.shape
        if (item.group, rows) in lengths:
            return False
        return (item.group, columns) in lengths or columns > _BESIDE * rows

    return [replace(item, array=Transposed(item.array), labels=()) if is_transposed(item) else item for item in items]


def _named(tables: Sequence[ArrayTable], name: str, others: Sequence[SkippedEntry], beside: bool) -> ArrayTable:
    """Return the table of that group, with that vector, or that matrix alone."""
    in_group = [table for table in tables if table.group == name]
    if in_group:
        return _main(in_group, beside)
    named = [(table, item) for table in tables for item in table.items if name in (item.path, item.name)]
    if len(named) > 1:
        raise InputError(f'there are several called "{name}". Choose {" or ".join(item.path for _, item in named)}.')
    if named:
        table, item = named[0]
        return table if item.is_vector else replace(table, items=[item])
    other = next((other for other in others if name in (join(other.group, other.name), other.name)), None)
    if other is not None:
        raise InputError(f'the table "{shorten(name)}" is not one of numbers but {other.what}.')
    known = [*dict.fromkeys(t.group for t in tables if t.group), *(item.path for t in tables for item in t.items)]
    raise InputError(f'there is no table called "{shorten(name)}".{did_you_mean(name, known)}')


def _main(tables: Sequence[ArrayTable], beside: bool) -> ArrayTable:
    """Return the only table, or the one to which the others are auxiliary."""
    if len(tables) == 1:
        return tables[0]
    if beside:
        timed = [table for table in tables if table.along and any(is_time(item.name) for item in table.items)]
        if len(timed) == 1:
            return timed[0]
        *shorter, longest = sorted(tables, key=lambda table: table.rows)
        if shorter[-1].rows * _BESIDE < longest.rows:
            return longest
    first = tables[0]
    one_group = all(table.group == first.group for table in tables)
    name = first.group if first.group and not one_group else min(first.items, key=lambda item: item.first).path
    listed = "; ".join(str(table) for table in tables[:8]) + ("; ..." if len(tables) > 8 else "")
    raise InputError(
        f"holds several tables: {listed}. Choose one in a sheet, by its group or a column of it, as in "
        f'file: {{table: "{name}"}}.'
    )

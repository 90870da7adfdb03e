"""Which arrays of a file are the table: those of one group and one length."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from nectosome.measure.formats.arrays import RowBlock
from nectosome.measure.formats.headings import is_time
from nectosome.measure.formats.items import Item, Other, Turned, join
from nectosome.units import InputError, count, did_you_mean, shorten

_BESIDE = 10  # a table that much shorter than another is a calibration beside it; a matrix that much wider lies


@dataclass
class ArrayTable:
    """Arrays of one group, one length and one dimension; `found`: how they were taken, and what was left out."""

    group: str
    rows: int
    along: str
    items: list[Item]
    found: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        names = shorten(", ".join(join(self.group, item.name) for item in self.items))
        return f"{names} ({count(self.rows, 'row')}{', ' if self.along else ''}{self.along})"

    def blocks(self) -> list[RowBlock]:
        """Its arrays as columns, coordinates first."""
        items = sorted(self.items, key=lambda item: not item.first)
        return [RowBlock(item.name, item.array, item.unit, item.labels, whole=len(items) == 1) for item in items]


def choose(things: Sequence[Item | Other], wanted: str | None, beside: bool = True) -> ArrayTable:
    """Return the table: the one `wanted` (a group, an array), else the only one. Raises InputError that lists them.

    In a group with several lengths it is the one with the time, or the one far longer than all others, if `beside`.
    """
    items = _upright([thing for thing in things if isinstance(thing, Item)])
    others = [thing for thing in things if isinstance(thing, Other)]
    tables = _tables(items)
    if not tables:
        inside = f" Inside: {'; '.join(str(other) for other in others[:8])}." if others else ""
        raise InputError(f"holds no columns of numbers.{inside}")
    if wanted is not None:
        table = _wanted(tables, wanted.strip("/"), others, beside)
    else:
        groups = {table.group: [t for t in tables if t.group == table.group] for table in tables}
        table = _main(tables, beside and len(groups) == 1)
    within = {item.path for item in table.items}
    rest = [f"left out: {t}" for t in tables if not within & {item.path for item in t.items}]
    turned = [f"{i.path}: its rows taken as columns" for i in table.items if isinstance(i.array, Turned)]
    notes = [note for item in table.items for note in item.notes]
    return replace(table, found=[*turned, *notes, *rest, *(f"left out: {other}" for other in others)])


def _tables(items: Sequence[Item]) -> list[ArrayTable]:
    tables: dict[tuple[str, int, str], ArrayTable] = {}
    for item in items:
        key = item.group, item.array.shape[0], item.along
        tables.setdefault(key, ArrayTable(*key, items=[])).items.append(item)
    return list(tables.values())


def _upright(items: Sequence[Item]) -> list[Item]:
    """Turn matrices that lie: as wide as a vector beside them is long, or far wider than tall."""
    lengths = {(item.group, item.array.shape[0]) for item in items if item.is_vector}

    def lies(item: Item) -> bool:
        if item.is_vector or item.along or item.array.dtype.names is not None:
            return False
        rows, columns = item.array.shape
        if (item.group, rows) in lengths:
            return False
        return (item.group, columns) in lengths or columns > _BESIDE * rows

    return [replace(item, array=Turned(item.array), labels=()) if lies(item) else item for item in items]


def _wanted(tables: Sequence[ArrayTable], wanted: str, others: Sequence[Other], beside: bool) -> ArrayTable:
    """Return the table called `wanted`: of that group, with that vector, or that matrix alone."""
    in_group = [table for table in tables if table.group == wanted]
    if in_group:
        return _main(in_group, beside)
    named = [(table, item) for table in tables for item in table.items if wanted in (item.path, item.name)]
    if len(named) > 1:
        raise InputError(f'there are several called "{wanted}". Choose {" or ".join(item.path for _, item in named)}.')
    if named:
        table, item = named[0]
        return table if item.is_vector else replace(table, items=[item])
    other = next((other for other in others if wanted in (join(other.group, other.name), other.name)), None)
    if other is not None:
        raise InputError(f'the table "{shorten(wanted)}" is not one of numbers but {other.what}.')
    known = [*dict.fromkeys(t.group for t in tables if t.group), *(item.path for t in tables for item in t.items)]
    raise InputError(f'there is no table called "{shorten(wanted)}".{did_you_mean(wanted, known)}')


def _main(tables: Sequence[ArrayTable], beside: bool) -> ArrayTable:
    """Return the only table, or the one beside which the others are small."""
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

"""Cells of a worksheet, and the position of its table: names, units, columns and first row, found in its top rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import date, datetime, time, timedelta
from typing import Any, Literal, NamedTuple, TypeAlias

from nectosome.measure.formats.clock_text import TextClock, clock_of, is_date_time, is_time_of_day
from nectosome.measure.formats.headings import Labels, bare_unit, find_label, is_unit, name_by_groups, split_unit
from nectosome.measure.formats.source import Column, Options

Kind: TypeAlias = Literal["empty", "missing", "number", "time", "text"]

_MISSING = {"nan", "n/a", "na", "#n/a", "-", "--", "null", "none"}
_DAY = 86400.0  # seconds
Row = Sequence[Any]


@dataclass(frozen=True)
class Broken:
    """A cell that lacks its number: the reason and the remedy."""

    why: str


UNCALCULATED = Broken("has a formula without a value. Open the workbook in Excel or LibreOffice, and save it there")


def kind(cell: Any) -> Kind:
    """Return the kind of a cell; a broken one is a number, "n/a" and the like are missing."""
    if cell is None:
        return "empty"
    if isinstance(cell, datetime | date | time | timedelta):
        return "time"
    if not isinstance(cell, str):
        return "number"
    word = cell.strip().lower()
    return "missing" if word in _MISSING else "text" if word else "empty"


def count(row: Sequence[Any], *kinds: Kind) -> int:
    """Return the number of cells of these kinds in a row."""
    return sum(kind(cell) in kinds for cell in row)


def seconds(cell: Any) -> float:
    """Return a time in seconds since Excel's day 0."""
    from openpyxl.utils.datetime import to_excel

    return float(to_excel(cell)) * _DAY


def as_number(cell: Any, origin: float | None) -> float:
    """Return the number in a cell, NaN for an empty one; in a column of times, seconds since its `origin`.

    Raises ValueError with the reason for any other cell.
    """
    if origin is None and type(cell) in (int, float):  # most cells
        return float(cell)
    what = kind(cell)
    if what in ("empty", "missing"):
        return float("nan")
    if isinstance(cell, Broken):
        raise ValueError(cell.why)
    if what == "text":
        raise ValueError(f'"{cell.strip()}" is text, not a number. Correct the cell, or empty it')
    if what == "time" and origin is not None:
        return round(seconds(cell) - origin, 3)  # the resolution of openpyxl
    if (what == "time") != (origin is not None):
        here, above = ("a time", "numbers") if what == "time" else ("a number", "times")
        raise ValueError(f"{cell} is {here} in a column of {above}. Give the whole column one format")
    return float(cell)


class Merged(NamedTuple):
    """Merged cells: first and last row and column, from 1."""

    top: int
    left: int
    bottom: int
    right: int


@dataclass(frozen=True)
class TablePlace:
    """A column of the table: its index in the sheet (from 0), the origin of its times [s], or what its texts mean."""

    index: int
    column: Column
    origin: float | None = None
    texts: TextClock | Labels | None = None

    def number(self, cell: Any) -> float:
        """Return the number that a cell stands for, NaN for an empty one. Raises ValueError with the reason."""
        if self.texts is None or kind(cell) in ("empty", "missing"):
            return as_number(cell, self.origin)
        if isinstance(self.texts, TextClock) and kind(cell) != "text":
            raise ValueError(f"{cell} is no text in a column of dates as text. Give the whole column one format")
        whole = isinstance(cell, float) and cell.is_integer()
        return self.texts.number(str(int(cell) if whole else cell).strip())


@dataclass(frozen=True)
class SheetLayout:
    """The table of a worksheet: its first row (from 1), its columns, its columns of text, and notes."""

    first: int
    places: tuple[TablePlace, ...]
    texts: dict[int, str]  # names of columns of text, by index
    found: tuple[str, ...]


def lay_out(rows: Sequence[Row], options: Options, merged: Sequence[Merged]) -> SheetLayout | None:
    """Return the table of a sheet that begins with `rows`; None without a row of numbers.

    Dates and times of day may be texts. Raises InputError where their order cannot be known.
    """
    header = options.header
    rows = _unmerged(rows, merged)
    if header and not (header <= len(rows) and _filled(rows[header - 1])):
        return None
    first = _first(rows, header)
    if first is None:
        return None
    names, units = _headings(rows, first, header)
    groups = _groups(rows, names, merged)
    places, texts, said = [], dict[int, str](), []
    said.append(f"names in row {names + 1}" if names is not None else "no row of names")
    said += [f"units in row {units + 1}"] if units is not None else []
    above = range((names if names is not None else first) - bool(groups))
    notes = [i + 1 for i in above if _filled(rows[i])]
    said += [f"left out: notes above the table, rows {notes[0]} to {notes[-1]}"] if notes else []
    width = max(map(len, rows))
    headings = [_text(rows, names, j) for j in range(width)]
    if names is not None and not groups:
        headings = name_by_groups(headings, _texts_above(rows, names, width))
    columns = [_column(j, headings[j], _text(rows, units, j), groups.get(j, "")) for j in range(width)]
    label = find_label(options.labels, columns)
    for j, column in enumerate(columns):
        cells = [row[j] for row in rows[first:] if j < len(row)]
        kinds = {kind(cell) for cell in cells}
        clock = _text_clock(cells, column, options) if "text" in kinds and not kinds & {"number", "time"} else None
        if j == label:
            places.append(TablePlace(j, column, texts=Labels()))
        elif clock is not None:
            start = "" if clock.daily or clock.only else str(clock.start)
            places.append(TablePlace(j, replace(column, unit="s", daily=clock.daily, start=start), texts=clock))
            said.append(f"{column.name}: text, {clock.note}")
        elif "text" in kinds and not kinds & {"number", "time"}:
            texts[j] = column.name
            said.append(f"left out: {column.name} (text)")
        elif kinds & {"number", "time", "missing"} or _text(rows, names, j):
            filled = [cell for cell in cells if kind(cell) in ("number", "time")]
            places.append(_place(j, column, filled))
            said += [f"{column.name}: seconds since {filled[0]}"] if places[-1].origin else []
    return SheetLayout(first + 1, tuple(places), texts, tuple(said))


def _column(j: int, name: str, unit: str, group: str) -> Column:
    named = split_unit(f"{group} {name}".strip()) if name else Column(f"column {j + 1}")
    return replace(named, unit=bare_unit(unit) if unit else named.unit, place=j + 1)


def _text_clock(cells: Sequence[Any], column: Column, options: Options) -> TextClock | None:
    """The clock of a column of texts that are all dates with times, or times of day."""
    texts = [cell.strip() for cell in cells if kind(cell) == "text"]
    if not (all(map(is_date_time, texts)) or all(map(is_time_of_day, texts))):
        return None
    return clock_of(texts, options.day_first, column.name)


def _place(j: int, column: Column, cells: Sequence[Any]) -> TablePlace:
    if not cells or kind(cells[0]) != "time":
        return TablePlace(j, column)
    elapsed = isinstance(cells[0], timedelta)  # a duration has its own zero
    daily, dated = isinstance(cells[0], time), isinstance(cells[0], date)
    known = replace(column, unit="s", daily=daily, start=str(cells[0]) if dated else "")
    return TablePlace(j, known, 0.0 if elapsed else seconds(cells[0]))


def _first(rows: Sequence[Row], header: int | None) -> int | None:
    """The index of the first row of the table.

    It has numbers, and texts only after its numbers. No row below it has only texts and more of them than the rows
    above have numbers: that would begin another table. Rows between it and its names belong to the table in any case.
    """
    if header is not None:
        return next((i for i in range(header, len(rows)) if _numbers(rows[i])), None)
    first, width = None, 0
    for i, row in enumerate(rows):
        numbers, texts = _numbers(row), count(row, "text")
        if numbers and (not texts or kind(row[_filled(row)[0]]) != "text"):
            first, width = (i if first is None else first), max(width, numbers)
        elif first is not None and texts > width and not numbers:
            first, width = None, 0
    first = _below_names(rows, first)
    return first if first is not None else _alike(rows)


def _alike(rows: Sequence[Row]) -> int | None:
    """The first of the last rows that have texts and numbers in the same columns, if these are three or more."""
    filled = [(i, [kind(cell) for cell in row]) for i, row in enumerate(rows) if _filled(row)]
    if not filled or not count(rows[filled[-1][0]], "number", "time"):
        return None
    alike = [i for i, kinds in filled if kinds == filled[-1][1]]
    last = next((k for k in range(1, len(filled) + 1) if filled[-k][1] != filled[-1][1]), len(filled) + 1) - 1
    return alike[-last] if last >= 3 else None


def _below_names(rows: Sequence[Row], first: int | None) -> int | None:
    """The first row below names for all its cells with only rows of numbers from it to `first`; else `first`."""
    for i, row in enumerate(rows[:first]):
        if not _numbers(row):
            continue
        names: set[int] = set()
        for above in reversed(rows[:i]):
            if _numbers(above):
                break
            names.update(_filled(above))
        below = [_numbers(r) for r in rows[i:first] if _filled(r)]
        alone = first is None and len(below) < 2  # a label and its value
        if names.issuperset(_filled(row)) and all(below) and not alone:
            return i
    return first


def _numbers(row: Row) -> int:
    return count(row, "number", "time")


def _filled(row: Row) -> list[int]:
    """The columns in which a row has a value."""
    return [j for j, cell in enumerate(row) if kind(cell) not in ("empty", "missing")]


def _headings(rows: Sequence[Row], first: int, header: int | None) -> tuple[int | None, int | None]:
    """The indices of the rows with names and with units."""
    above = [i for i in range(first) if _filled(rows[i])]
    if header is not None:
        below = [i for i in above if i >= header and _are_units(rows[i])]
        return (header - 1 if header else None), (below[0] if header and below else None)
    if not above or _numbers(rows[above[-1]]):
        return None, None
    last = above[-1]
    if len(above) > 1 and above[-2] == last - 1 and _are_units(rows[last]) and _covers(rows[last - 1], rows[last]):
        return last - 1, last
    return last, None


def _are_units(row: Row) -> bool:
    cells = [str(cell) for cell in row if kind(cell) != "empty"]
    return bool(cells) and all(is_unit(cell) for cell in cells)


def _covers(upper: Row, lower: Row) -> bool:
    """Whether the upper row has text wherever the lower one is not empty."""
    return all(j < len(upper) and kind(upper[j]) == "text" for j, cell in enumerate(lower) if kind(cell) != "empty")


def _text(rows: Sequence[Row], i: int | None, j: int) -> str:
    if i is None or j >= len(rows[i]) or kind(rows[i][j]) == "empty":
        return ""
    return str(rows[i][j]).strip()


def _texts_above(rows: Sequence[Row], names: int, width: int) -> list[list[str]]:
    """The rows of nothing but texts right above the names, the highest first."""
    above = list[list[str]]()
    for i in range(names - 1, -1, -1):
        if _numbers(rows[i]) or len(_filled(rows[i])) < 2:
            break
        above.insert(0, [_text(rows, i, j) for j in range(width)])
    return above


def _unmerged(rows: Sequence[Row], merged: Sequence[Merged]) -> Sequence[Row]:
    """Move the text of cells merged within a column to the last of them, into the row of the other names."""
    rows = [list(row) for row in rows]
    for top, left, bottom, right in merged:
        highest = rows[top - 1] if left == right and top < bottom <= len(rows) else []
        if left <= len(highest) and kind(highest[left - 1]) == "text":
            lowest = rows[bottom - 1]
            lowest.extend([None] * (left - len(lowest)))
            lowest[left - 1], highest[left - 1] = highest[left - 1], None
    return rows


def _groups(rows: Sequence[Row], names: int | None, merged: Sequence[Merged]) -> Mapping[int, str]:
    """Text of merged cells right above several names, by column: "force" above x, y and z."""
    groups: dict[int, str] = {}
    named = set(_filled(rows[names])) if names else set()
    for top, left, bottom, right in merged:
        inside = range(left - 1, right)
        if top == bottom == names and named.difference(inside):  # one over all names is a title
            groups |= dict.fromkeys(inside, _text(rows, top - 1, left - 1))
    return groups

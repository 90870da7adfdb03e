"""Tables, trees and sentences of numbers with units, as lines of text that fit a width, and tables as JSON."""

import math
import re
import textwrap
from collections.abc import Collection, Iterator, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from itertools import zip_longest
from typing import Any, NamedTuple

from rich.text import Text

from nectosome.units import cut_words
from nectosome.units.zero import counts_as_zero

_LEAST = 12  # characters of a column of words, however narrow the terminal
_NARROWEST = 24  # characters of a branch
_TOGETHER = 48  # characters of columns of numbers that share their units
_GAP = "  "
_GLUE = "\xa0"  # in place of a blank at which no line may end
_QUANTITY = re.compile(r"\d(?: [A-Za-zµ]{1,3}\d?(?:/[a-z]+\d?)?){1,3}(?![A-Za-z])|\d (?=\D)")
AXES = {"x": "x", "y": "y", "z": "z"}
"""Columns of a vector."""


class Number(NamedTuple):
    """A number in SI units with its unit.

    `peak` is the largest magnitude of what it is a mean of; `shown` is its text in another unit, or in words.
    """

    value: float
    unit: str = ""
    peak: float = 0.0
    shown: str = ""

    @property
    def measured(self) -> bool:
        """Whether it is shown as a number and its unit."""
        return not self.shown and not math.isnan(self.value)

    def to_json(self) -> dict[str, Any]:
        """Value and unit; a value that is NaN or infinite is null, with what is shown for it as the reason."""
        if math.isfinite(self.value):
            return {"value": self.value, "unit": self.unit or "1"}
        return {"value": None, "unit": self.unit or "1", "reason": self.shown or "not defined"}


class Label(NamedTuple):
    """The name of a row: its key in JSON, and how it is shown."""

    key: str
    shown: str


Cell = Number | Label | str


@dataclass(frozen=True)
class Table:
    """Rows of cells below `columns`, headings by key. The first cell names the row; a row may be short.

    - listed: names may repeat, or mean little: JSON has a list of rows, else an object of rows by their names.
    - computed: numbers come from a solver. Those that `counts_as_zero` against the largest of their unit in the table,
      or `beside` it, are shown as 0, and an axis (x, y, z) whose numbers are all 0 is not shown. JSON has them as they
      are.
    - hidden: columns that only JSON has.
    - apart: each number has its unit beside it, where columns are of different things.
    """

    key: str
    columns: Mapping[str, str]
    rows: Sequence[Sequence[Cell]]
    listed: bool = False
    computed: bool = False
    hidden: Collection[str] = ()
    apart: bool = False
    beside: Mapping[str, float] = field(default_factory=dict)  # largest magnitudes by unit

    def to_json(self) -> Any:
        """Rows by name, or a list of rows: an object of cells by column; only the number where there is just one."""
        if self.listed:
            return [{key: _plain(cell) for key, cell in zip(self.columns, row, strict=False)} for row in self.rows]
        _, *others = self.columns
        found = {}
        for name, *cells in self.rows:
            row = {key: _plain(cell) for key, cell in zip(others, cells, strict=False)}
            found[_plain(name)] = row if len(others) > 1 else next(iter(row.values()), None)
        return found

    def lines(self, width: int) -> Iterator[Text]:
        """Lines of text. Columns that do not fit go below, beside the names of the rows."""
        name, *blocks = self._blocks(apart=self.apart)
        for k, part in enumerate(_parts(name, blocks, width) if self.rows and blocks else []):
            yield from [Text()] if k else []
            yield from _joined(part)

    def texts(self) -> list[tuple[str, ...]]:
        """Headings and rows as text, a cell for each column that is shown, each number with its unit."""
        return [*zip(*(map(str.strip, block.shown) for block in self._blocks(apart=True)), strict=True)]

    def numbers(self) -> Iterator[tuple[str, str, Number]]:
        """Name of the row, heading, and number of each cell that has one; with `computed`, 0 where that is shown."""
        largest = self._largest()
        for name, *cells in self.rows:
            for (key, head), cell in zip([*self.columns.items()][1:], cells, strict=False):
                if isinstance(cell, Number) and key not in self.hidden:
                    zero = self.computed and counts_as_zero(cell.value, largest[cell.unit], cell.peak)
                    shown = name.shown if isinstance(name, Label) else str(name)
                    yield shown, head, cell._replace(value=0.0) if zero else cell

    def _largest(self) -> dict[str, float]:
        """Largest magnitudes by unit."""
        largest = dict(self.beside)
        for cell in (
            cell for row in self.rows for cell in row if isinstance(cell, Number) and cell.value == cell.value
        ):
            largest[cell.unit] = max(largest.get(cell.unit, 0.0), abs(cell.value))
        return largest

    def _blocks(self, *, apart: bool) -> "list[_Block]":
        """Columns as text; unless `apart`, numbers that share their units are in one, with these behind the last."""
        rows = [[*row, *[""] * (len(self.columns) - len(row))] for row in self.rows]
        largest = self._largest()
        found = list[_Block]()
        for k, (key, head) in enumerate(self.columns.items()):
            if key in self.hidden:
                continue
            numbers = [row[k] for row in rows if isinstance(row[k], Number)]
            texts = [self._text(row[k], largest) for row in rows]
            if not numbers:
                found += [_Block([head, *texts])] if k == 0 or any(texts) else []
                continue
            split = [text.partition(" ") for text in texts]
            if self.computed and key in AXES and {text for text, _, _ in split} <= {"0", ""}:
                continue
            size = max(len(head), *(len(text) for text, _, _ in split))
            flush, units = [f"{text:>{size}}" for text in (head, *(x for x, _, _ in split))], [x for _, _, x in split]
            last = found[-1] if found and any(units) and not apart else None
            if last is not None and last.units and last.width + size < _TOGETHER and _share(last, split):
                flush = [f"{left}{_GAP}{right}" for left, right in zip(found.pop().cells, flush, strict=True)]
                units = [one or other for one, other in zip(last.units, units, strict=True)]
            found.append(_Block(flush, units))
        return found

    def _text(self, cell: Cell, largest: Mapping[str, float]) -> str:
        if isinstance(cell, str):
            return cut_words(cell)  # else a long name would make the column as wide
        if isinstance(cell, Label) or not cell.measured:
            return cut_words(cell.shown)
        zero = self.computed and counts_as_zero(cell.value, largest[cell.unit], cell.peak)
        return f"{number(0.0 if zero else cell.value)} {cell.unit}".strip()


@dataclass
class Branch:
    """A name, what is said of it, and branches that hang on it: a tree as text."""

    name: str
    text: str = ""
    branches: "list[Branch]" = field(default_factory=list)

    def lines(self, width: int, first: str = "", later: str = "") -> Iterator[Text]:
        """Lines of text: `first` before the first one of its own, `later` before the others."""
        own = wrapped(f"{self.name}{_GAP}{self.text}", max(width - len(first), _NARROWEST), "")
        for k, line in enumerate(own):
            bold = len(self.name) if k == 0 else 0
            yield Text.assemble(later if k else first, (line[:bold], "bold"), line[bold:])
        for k, branch in enumerate(self.branches, start=1):
            corner, beside = ("└── ", "    ") if k == len(self.branches) else ("├── ", "│   ")
            yield from branch.lines(width, later + corner, later + beside)


def number(value: float) -> str:
    """Return a number with four digits."""
    return f"{value + 0.0:.4g}"  # no -0


def with_error(value: float, error: float) -> str:
    """Return a number with the digits that its error leaves, and the error rounded up to one digit."""
    if not (0 < error < math.inf):
        return number(value)
    places = math.ceil(-math.log10(error))
    last = 10.0**-places
    up = max(math.ceil(error / last - 1e-9), 1) * last
    return f"{round(value / last) * last + 0.0:.{max(places, 0)}f} +- {up:.{max(places, 0)}f}"


def wrapped(text: str, width: int, indent: str = "  ") -> list[str]:
    """Return lines that end between words, never within a number and its unit; later ones are indented.

    A path, which is a single word, may be broken behind its slashes.
    """
    if len(text) > width and "/" in text and " " not in text:
        return [line.replace("/ ", "/") for line in wrapped(text.replace("/", "/ "), width, indent)]
    glued = _QUANTITY.sub(lambda found: found[0].replace(" ", _GLUE), text)
    options: dict[str, Any] = {"subsequent_indent": indent, "break_long_words": False, "break_on_hyphens": False}
    return [line.replace(_GLUE, " ") for line in textwrap.wrap(glued, max(width, 1), **options)] or [""]


def _plain(cell: Cell) -> Any:
    return cell.to_json() if isinstance(cell, Number) else cell.key if isinstance(cell, Label) else cell


class _Block:
    """Columns that stay together, as text with the heading first: of words, or of numbers with `units` behind."""

    def __init__(self, cells: list[str], units: list[str] | None = None):
        self.cells, self.units = cells, units
        if units is not None and any(units):
            self.shown = [f"{cell} {unit}" for cell, unit in zip(cells, ["", *units], strict=True)]
        else:
            self.shown = cells
        self.width = max(map(len, self.shown))

    @property
    def least(self) -> int:
        """Width of the longest word; numbers are not narrowed."""
        if self.units is not None:
            return self.width
        return min(self.width, max(_LEAST, *(len(line) for cell in self.cells for line in wrapped(cell, 1, ""))))

    def lines(self, row: int) -> list[str]:
        """Text of a row in the width."""
        return [self.shown[row]] if self.units is not None else wrapped(self.shown[row], self.width, "")


def _share(block: _Block, split: Sequence[tuple[str, str, str]]) -> bool:
    """Whether numbers have the units of the block before them; a cell without a number has any unit."""
    before = zip(block.cells[1:], block.units or (), strict=True)
    each = zip(before, split, strict=True)
    return all(unit == own or not text or not left.strip() for (left, own), (text, _, unit) in each)


def _parts(name: _Block, blocks: list[_Block], width: int) -> Iterator[list[_Block]]:
    """Blocks that fit beside each other, each part with the names of the rows; words are narrowed where that does."""
    part = [name]
    for block in blocks:
        if len(part) > 1 and _needed([each.least for each in (*part, block)]) > width:
            yield _narrowed(part, width)
            part = [name]
        part.append(block)
    yield _narrowed(part, width)


def _needed(widths: list[int]) -> int:
    return sum(widths) + len(_GAP) * (len(widths) - 1)


def _narrowed(part: list[_Block], width: int) -> list[_Block]:
    """The widest words are wrapped first."""
    part = [*map(copy, part)]
    while _needed([block.width for block in part]) > width:
        loose = [block for block in part if block.width > block.least]
        if not loose:
            break
        max(loose, key=lambda block: block.width).width -= 1
    return part


def _joined(part: list[_Block]) -> Iterator[Text]:
    """Lines of a part, headings first."""
    titled = any(block.shown[0].strip() for block in part)
    for row in range(0 if titled else 1, len(part[0].shown)):
        for line in zip_longest(*(block.lines(row) for block in part), fillvalue=""):
            cells = (f"{text:<{block.width}}" for text, block in zip(line, part, strict=True))
            yield Text(_GAP.join(cells).rstrip(), "" if row else "bold")

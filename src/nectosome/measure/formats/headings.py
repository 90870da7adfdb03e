"""Column headings: the name, the unit in brackets, whether it is the time; columns of text."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import count

import numpy as np
import pandas as pd

from nectosome.measure.formats.source import Column
from nectosome.measure.formats.time_names import is_time
from nectosome.units import scale_to_si

_SYMBOL = (
    "°C|°F|degC|degF|deg C|deg F|deg|°|%|‰|BL|bar|psi|rpm|rev|rad|min|sec|msec|mol|lbf|lb|in|ft|px|dB|eV|strain|ε|"
    "[munpµμkMGcdh]?(?:Hz|Pa|Ohm|ohm|Ω|[mgsANVWJCFHTKLlh])"
)
_WORD = (
    r"pixels?|frames?|[Cc]ounts?|[Vv]olts?|[Aa]mp(?:ere)?s?|[Nn]ewtons?|[Pp]ascals?|[Hh]ertz|[Dd]egrees?|[Rr]adians?|"
    r"(?:milli|micro)?[Ss]econds?|(?:milli|centi)?[Mm]et(?:er|re)s?|[Cc]elsius|[Kk]elvin"
)
_FACTOR = rf"(?:{_SYMBOL}|{_WORD}|1)(?:(?:\^|\*\*)?-?[1-9]|⁻?[¹²³])?"
_PRODUCT = rf"{_FACTOR}(?:(?:\s*[*·/]\s*|\s+|\.){_FACTOR})*"
_UNIT = re.compile(rf"{_PRODUCT}(?:\s*/\s*\({_PRODUCT}\))?|-|a\.u\.")
_BRACKETED = re.compile(r"\[([^\[\]]*)\]|\((.*)\)")
_SQUARE = re.compile(r"(.*?)\s*\[([^\[\]]*)\]")
_ROUND = re.compile(r"(.*?)\s*\((.*)\)")
_INDEX = re.compile(r"[\d\s,:]*")


def split_unit(heading: str) -> Column:
    """Return name and unit of a heading such as `force [N]` or `time (ms)`.

    Round brackets count only if they hold a unit, unlike `force (left)`; square ones only if they hold no index.
    """
    heading = heading.strip()
    square = _SQUARE.fullmatch(heading)
    if square and not _INDEX.fullmatch(square[2]):
        return Column(square[1], square[2].strip(), heading)
    around = _ROUND.fullmatch(heading)
    if around and _is_unit(around[2].strip()):
        return Column(around[1], around[2].strip(), heading)
    return Column(heading, heading=heading)


def split_units(headings: Iterable[str]) -> list[Column]:
    """Return name and unit of each heading; what tells columns apart is no unit, as in `flap (L)`, `flap (R)`."""
    columns = [split_unit(heading) for heading in headings]
    apart = {around[1] for c in columns if not c.unit and (around := _ROUND.fullmatch(c.name))}
    return [Column(c.heading, heading=c.heading) if c.name in apart and c.unit else c for c in columns]


def split_known_unit(column: Column) -> Column:
    """Return a column whose name may hold a unit in brackets, as in `force (N)`, with name and unit apart."""
    split = split_unit(column.name)
    known = not column.unit and split.name and split.unit and _is_unit(split.unit)
    return replace(column, name=split.name, unit=split.unit) if known else column


def _is_unit(text: str) -> bool:
    """Whether a text in brackets is a unit."""
    return text != "1" and (_UNIT.fullmatch(text) is not None or is_known_unit(text))


@lru_cache(10_000)
def is_known_unit(text: str) -> bool:
    """Whether a text is a unit that can be converted to SI."""
    try:
        scale_to_si(text)
    except ValueError:
        return False
    return text.strip() != ""


def is_unit(cell: str) -> bool:
    """Whether a cell looks like a unit: `N`, `[m/s]`, `(°C)`, `%`, `-` for none."""
    bare = bare_unit(cell)
    return cell.strip().startswith("[") or _UNIT.fullmatch(bare) is not None or (len(bare) > 1 and is_known_unit(bare))


def is_bracketed(cell: str) -> bool:
    """Whether the whole cell is in brackets."""
    return _BRACKETED.fullmatch(cell.strip()) is not None


def bare_unit(cell: str) -> str:
    """Return a cell without its brackets."""
    match = _BRACKETED.fullmatch(cell.strip())
    return (match[1] or match[2] or "").strip() if match else cell.strip()


def distinct(columns: Iterable[Column]) -> tuple[Column, ...]:
    """Return the columns with distinct names: a second `force` becomes `force (2)`."""
    columns = list(columns)
    taken, given = {column.name for column in columns}, set[str]()
    last: dict[str, int] = {}  # number that a name was given
    for i, column in enumerate(columns):
        if column.name in given:
            numbers = count(last.get(column.name, 1) + 1)
            name, last[column.name] = next((x, n) for n in numbers if (x := f"{column.name} ({n})") not in taken)
            columns[i] = replace(column, name=name)
        taken.add(columns[i].name)
        given.add(columns[i].name)
    return tuple(columns)


def fill_right(cells: Sequence[str], below: Sequence[str]) -> list[str]:
    """Fill empty cells from the left where there is a name below: "force,,," above x, y and z."""
    filled, last = list[str](), ""
    for cell, name in zip(cells, below, strict=True):
        last = cell or last
        filled.append(last if name else cell)
    return filled


def stack(rows: Sequence[Sequence[str]]) -> list[str]:
    """Join the cells of each column, from the first row to the last: "nose" above "x" is "nose x"."""
    return [" ".join(dict.fromkeys(cell for cell in column if cell)) for column in zip(*rows, strict=True)]


def name_by_groups(names: Sequence[str], above: Sequence[Sequence[str]]) -> list[str]:
    """Return names that occur twice with what stands above them; rows that are the same all over say nothing.

    The first time keeps its name: it is that of all.
    """
    names = list(names)
    given = [name for name in names if name]
    rows = [fill_right(row, names) for row in above]
    rows = [row for row in rows if len({cell for cell, name in zip(row, names, strict=True) if name and cell}) > 1]
    if len(set(given)) == len(given) or not rows:
        return names
    time = next((k for k, name in enumerate(names) if is_time(name)), None)
    stacked = stack([*rows, names])
    if time is not None:
        stacked[time] = names[time]
    return stacked


class Labels:
    """The texts of a column in the order of their first occurrence; `number` is the place of one, from 0."""

    def __init__(self) -> None:
        self.texts: list[str] = []
        self._places: dict[str, int] = {}

    def number(self, cell: str) -> float:
        """Return the place of a text."""
        cell = cell.strip()
        place = self._places.setdefault(cell, len(self.texts))
        if place == len(self.texts):
            self.texts.append(cell)
        return float(place)

    def numbers(self, cells: pd.Series) -> np.ndarray:
        """Return the places of many texts, NaN for missing ones."""
        codes, distinct = pd.factorize(cells)
        places = np.array([*(self.number(text) for text in distinct), np.nan])
        return places[codes]


def find_label(chosen: int | str | None, columns: Sequence[Column]) -> int | None:
    """Return the index of the column with this place or name among all of a file; None if there is none."""
    for k, column in enumerate(columns):
        if chosen in (column.place, column.name, column.heading):
            return k
    return None

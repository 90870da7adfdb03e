"""Column headings: the name, the unit in brackets, and whether the column is the time."""

import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import count

from nectosome.measure.formats.source import Column

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
_TIME = re.compile(
    r"(?:t|(?i:(?:elapsed[ _]?)?time|timestamp|zeit|sec|seconds))(?:[\s_]*[\[(].*|[\s_.](?:[munµμ]?s|m?sec|min|h))?"
)


def split_unit(heading: str) -> Column:
    """Return name and unit of a heading such as `force [N]` or `time (ms)`.

    Round brackets count only if they hold a unit, unlike `force (left)`; square ones only if they hold no index.
    """
    heading = heading.strip()
    square = _SQUARE.fullmatch(heading)
    if square and not square[2].strip().isdigit():
        return Column(square[1], square[2].strip())
    around = _ROUND.fullmatch(heading)
    if around and _UNIT.fullmatch(around[2].strip()):
        return Column(around[1], around[2].strip())
    return Column(heading)


def is_unit(cell: str) -> bool:
    """Whether a cell looks like a unit: `N`, `[m/s]`, `(°C)`, `%`, `-` for none."""
    return cell.strip().startswith("[") or _UNIT.fullmatch(bare_unit(cell)) is not None


def is_bracketed(cell: str) -> bool:
    """Whether the whole cell is in brackets."""
    return _BRACKETED.fullmatch(cell.strip()) is not None


def bare_unit(cell: str) -> str:
    """Return a cell without its brackets."""
    found = _BRACKETED.fullmatch(cell.strip())
    return (found[1] or found[2] or "").strip() if found else cell.strip()


def distinct(columns: Iterable[Column]) -> tuple[Column, ...]:
    """Return the columns with distinct names: a second `force` becomes `force (2)`."""
    columns = list(columns)
    taken, given = {column.name for column in columns}, set[str]()
    for i, column in enumerate(columns):
        if column.name in given:
            name = next(free for n in count(2) if (free := f"{column.name} ({n})") not in taken)
            columns[i] = replace(column, name=name)
        taken.add(columns[i].name)
        given.add(columns[i].name)
    return tuple(columns)


def is_time(name: str) -> bool:
    """Whether a name means the time: `t`, `Time`, `time_s`, `Zeit [s]`; `T` is a temperature or torque."""
    return _TIME.fullmatch(name.strip()) is not None

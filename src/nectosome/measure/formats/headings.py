"""What the heading of a column says beside its name: a unit in brackets, or that the column is the time."""

import re
from collections.abc import Iterable
from dataclasses import replace
from itertools import count

from nectosome.measure.formats.source import Column

_BRACKETS = re.compile(r"(.*\S)\s*(?:\[([^\[\]]*)\]|\(([^()]*)\))")
_TIME = re.compile(r"(?:t|(?i:time|timestamp|zeit))(?:[\W_].*)?")  # T is a temperature or a torque

_SYMBOL = r"[nuµμmckMG]?(?:m|g|s|rad|Hz|N|Pa|bar|J|W|L|l|V|A|K|T|Ohm|Ω|ohm|F|strain|ε)"
_WORD = (
    r"sec|min|h|d|t|rpm|rev|deg|°|psi|in|ft|dB|px|[Vv]olts?|[Aa]mp(?:ere)?s?|[Nn]ewtons?|[Pp]ascals?|[Hh]ertz|"
    r"(?:milli|micro)?[Ss]econds?|(?:milli|centi)?[Mm]et(?:er|re)s?|[Dd]egrees?|[Rr]adians?|[Cc]ounts?|[Pp]ixels?|"
    r"°C|°F|degC|degF|deg C|deg F|C|[Cc]elsius|[Kk]elvin"
)
_FACTOR = rf"(?:{_WORD}|{_SYMBOL})(?:(?:\*\*|\^)?-?[1-9]|[²³])?"
_UNIT = re.compile(rf"%|-|(?:1\s*/\s*)?{_FACTOR}(?:\s*[*·./ ]\s*{_FACTOR})*")


def split_unit(heading: str) -> Column:
    """Return the column of a heading such as `force [N]` or `force (N)`; round brackets only where they hold a unit."""
    match = _BRACKETS.fullmatch(heading.strip())
    if match is None or (match[2] is None and not is_unit(match[3])):
        return Column(heading.strip())
    return Column(match[1], (match[2] or match[3] or "").strip())


def is_unit(text: str) -> bool:
    """Whether a text reads as a unit, in brackets or not: `N`, `[m/s]`, `°C`, `%`, and `-` for none."""
    text = text.strip()
    if len(text) > 2 and text[0] + text[-1] in ("[]", "()"):
        return text[0] == "[" or is_unit(text[1:-1])
    return _UNIT.fullmatch(text) is not None


def distinct(columns: Iterable[Column]) -> tuple[Column, ...]:
    """Return the columns with `force`, `force` made `force`, `force (2)`."""
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
    """Whether a column is the time by its name: `t`, `Time`, `time_s`, `Zeit [s]`."""
    return _TIME.fullmatch(name.strip()) is not None

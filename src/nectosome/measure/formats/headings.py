"""Column headings: the name, the unit in brackets or in the name and what it means there, the time; columns of text."""

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from itertools import count
from typing import NamedTuple

import numpy as np
import pandas as pd

from nectosome.measure.formats.source import Column
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


_UNITS = (
    "s|secs?|seconds?|m(?:illi)?s(?:ecs?|econds?)?|millis|[uµμ]s(?:ecs?)?|micros(?:ecs?|econds?)?|"
    "ns(?:ecs?)?|nanos(?:ecs?|econds?)?|mins?|minutes?|h|hrs?|hours?|days?"
)
_KIND = "elapsed|relative|absolute|unix|epoch|utc|local|system|sample|test|host|ros|rosbag"
_WORDS = (
    rf"_*(?:(?:{_KIND})[ _]?)?time(?:[ _]?stamp)?s?|(?:{_KIND})[ _]?stamp|time[ _](?:since|of|from)[ _]\w+|"
    r"zeit|uhrzeit|clock|date[ _/&]*(?:and[ _])?time|(?:.*[./])?header[./_]stamp"
)
# "T" is a temperature or a torque; "timeMs" has its unit in capitals
_TIME = re.compile(
    rf"(?:t|(?i:{_WORDS}))(?:(?:[\s_.]+(?:in\s)?|\s*/\s*)(?i:(?P<unit>{_UNITS}|unix|utc|epoch))|"
    r"(?<=ime|amp)(?P<capital>M[sS]|U[sS]|N[sS]|S|Secs?|Seconds?|Millis|Micros|Nanos))?"
)
_UNIT_ALONE = re.compile(
    r"secs?|seconds?|millis(?:\(\))?|msecs?|milli(?:secs?|seconds?)|micros(?:\(\))?|usecs?|"
    r"micro(?:secs?|seconds?)|nano(?:secs?|seconds?)|ms",
    re.IGNORECASE,
)
_UNIT_BEHIND = re.compile(r"(.*?)[\s_]*[\[(](.*)[\])]")
_SECONDS, _NANOSECONDS = re.compile(r"(.*)(?<![a-z])secs?", re.I), ("nsecs", "nsec", "nanosec", "nanosecs")
_NO_UNIT = ("unix", "utc", "epoch", "gmt", "local", "h:m:s", "hh:mm:ss", "hh:mm:ss.fff", "")


def is_time(name: str) -> bool:
    """Whether a name means the time: `t`, `Time`, `time_ms`, `Zeit [s]`; `T` is a temperature or torque."""
    return time_unit(name) is not None


def time_unit(name: str) -> str | None:
    """Return the unit in the name of a time ("ms" of `time_ms`), as it is there, "" without one; None for other names.

    Whatever stands in brackets behind a time is its unit, but for words such as UTC.
    """
    name = name.strip()
    bracketed = _UNIT_BEHIND.fullmatch(name)
    if bracketed and not _UNIT_ALONE.fullmatch(name):
        inside = time_unit(bracketed[1])
        return None if inside is None else "" if bracketed[2].strip().lower() in _NO_UNIT else bracketed[2].strip()
    if _UNIT_ALONE.fullmatch(name):
        return name.removesuffix("()").lower()
    match = _TIME.fullmatch(name)
    if match is None:
        return None
    unit = (match["unit"] or match["capital"] or "").lower()
    return "" if unit in _NO_UNIT else unit


def nanoseconds_beside(name: str, names: list[str]) -> str | None:
    """Return the column with the nanoseconds that belong to whole seconds, as ROS writes a stamp; None without one.

    `header.stamp.secs` and `header.stamp.nsecs`, or `sec` and `nanosec`.
    """
    match = _SECONDS.fullmatch(name.strip())
    if match is None:
        return None
    beside = {match[1] + ending for ending in _NANOSECONDS}
    return next((other for other in names if other.strip() in beside), None)


_ACCELERATION = re.compile(
    r"(?i)(?:.*[\W_\d])?(?:\w*acc(?:el\w*)?|acc[xyz]|g-?force|imu)(?![a-bd-z])|a_?[xyz](?![a-z])"
)
_MASS = re.compile(r"(?i).*(?:mass|weight|load|balance|scale|payload|ballast|gewicht|last)|m(?![a-z])")
_TEMPERATURE = re.compile(r"(?i)(?:.*[\W_\d])?t(?:emp(?:erature\w*)?)?(?![a-z])|.*temp|.*thermo")
_FORCE = re.compile(r"(?i)(?:.*[\W_\d])?(?:force|thrust|lift|drag|pull|push|kraft|schub)")
_TORQUE = re.compile(r"(?i)(?:.*[\W_\d])?(?:torque|moment|drehmoment)")
_LENGTH = re.compile(r"(?i).*(?:pos|len|height|disp|dist|depth|travel|stroke|width|diam|level|gap|tip|x|y|z)")
_VOLUME = re.compile(r"(?i).*(?:vol|tank|chamber|reservoir|bladder|capacity|water|filling)|v(?![a-z])")
_DURATION = re.compile(r"(?i).*(?:time|duration|age|period|zeit|dauer)|t(?![a-z])")
_G = {"g": "gn", "gs": "gn", "G": "gn", "mg": "mgn"}
_MASSES = {"g", "mg", "kg", "Kg", "KG", "lb", "lbs", "oz"}
_LENGTHS = {"nm", "NM", "mm", "m"}
# in round brackets these may be words or letters: the names beside which they are units
_ALSO_WORDS = {"in": _LENGTH, "min": _DURATION, "h": _DURATION, "L": _VOLUME, "l": _VOLUME, "t": _MASS}
_LAST_BRACKET = re.compile(r"(.*?)\s*\(([^()]*)\)")
_ENDS = re.compile(r"(?:.*[a-z0-9])?(?:[\s_]+(?:in\s)?|\s/\s)([A-Za-zµμ°%]+\d?(?:/[a-z]+\d?)?)", re.IGNORECASE)
_NO_UNITS = {"in", "min", "h", "hr", "t", "l", "d", "count", "counts", "frame", "frames", "day", "days", "px", "bar"}
_LETTERS = frozenset("NVAWJK%°")


class UnitMeaning(NamedTuple):
    """The unit that is meant, a remark on what was made of it, and a doubt to warn of."""

    unit: str
    remark: str = ""
    doubt: str = ""


def unit_of(column: Column) -> UnitMeaning:
    """Return what the unit of a column in a file means for a quantity of its name; "" where it may be several."""
    name, unit = column.name, column.unit
    if unit in _G and _ACCELERATION.match(name):
        return UnitMeaning(_G[unit], f"{unit} of an acceleration, 9.80665 m/s2{' / 1000' if unit == 'mg' else ''}")
    if unit in ("g", "gs", "mg") and not (_MASS.match(name) or _FORCE.match(name)):
        choice = f"unit: {unit}, for a mass, or unit: {_G[unit]}, of 9.80665 m/s2"
        return UnitMeaning("", doubt=f'"{unit}" may be grams or an acceleration: not converted. Write {choice}')
    if unit in _ALSO_WORDS and column.heading.endswith(")") and not _ALSO_WORDS[unit].match(name):
        return UnitMeaning(
            "", doubt=f'"{unit}" may be a unit or a word: not converted. If it is one, write unit: {unit}'
        )
    if unit in ("C", "F") and _TEMPERATURE.match(name):
        return UnitMeaning(f"deg{unit}")
    if unit in _MASSES and _FORCE.match(name):
        force = {"g": "gf", "mg": "mgf", "oz": "ozf", "lb": "lbf", "lbs": "lbf"}.get(unit, "kgf")
        return UnitMeaning(unit, doubt=f'is in "{unit}", a mass. If it is a force, write unit: {force}')
    if unit in _LENGTHS and _TORQUE.match(name):
        torque = "N mm" if unit == "mm" else "N m"
        return UnitMeaning(unit, doubt=f'is in "{unit}", a length. If it is a torque, write unit: {torque}')
    return UnitMeaning(unit)


def unit_in_name(name: str) -> str:
    """Return the unit with which a name ends (x_cm, force / N) or which it is (RPM), but not in brackets; else ""."""
    match = _ENDS.fullmatch(name)
    ending = match[1] if match else name if name.isalpha() else ""
    if ending.lower() in _NO_UNITS or (len(ending) == 1 and (match is None or ending not in _LETTERS)):
        return ""
    return ending if is_known_unit(ending) else ""


def unknown_bracket(name: str) -> str:
    """Return what stands in brackets at the end of a name and is no unit, as in "flap (left)"; else ""."""
    match = _LAST_BRACKET.fullmatch(name)
    return match[2].strip() if match and not match[2].strip().isdigit() else ""

"""Dates and times of day as text: which cells hold one, and the seconds that they mean."""

import re
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass

import numpy as np
import pandas as pd

from nectosome.units import InputError, shorten

_NAMES = ("jan", "feb", "mar", "apr", "may", "jun", "jul", "aug", "sep", "oct", "nov", "dec")
_MONTHS = {name: k for k, name in enumerate(_NAMES, 1)}  # `calendar` speaks the language of its user
_NAMED = "(?i:" + "|".join(_MONTHS) + ")[a-z]*"
_TIME = r"(?P<hour>\d{1,2}):(?P<minute>\d\d)(?::(?P<second>\d\d(?:[.,]\d{1,30})?))?(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?"
_ZONE = r"(?:\s?(?P<zone>Z|UTC|GMT|[-+]\d\d:?\d\d))?"
_DATE_TIME = [
    re.compile(rf"{date}(?:[T ]|,\s?){_TIME}{_ZONE}", re.ASCII)
    for date in (
        r"(?P<year>\d{4})(?P<sign>[-/.])(?P<month>\d{1,2})(?P=sign)(?P<day>\d{1,2})",
        r"(?P<one>\d{1,2})(?P<sign>[-/.])(?P<two>\d{1,2})(?P=sign)(?P<year>\d{4}|\d\d)",
        rf"(?P<day>\d{{1,2}})[- ](?P<name>{_NAMED})[- ](?P<year>\d{{4}})",
        rf"(?P<name>{_NAMED})\s(?P<day>\d{{1,2}}),?\s(?P<year>\d{{4}})",
    )
]
_OF_DAY = re.compile(
    r"(?P<hour>\d{1,3}):(?P<minute>\d\d):(?P<second>\d\d(?:[.,:]\d{1,30})?)(?:\s?(?P<half>[AaPp])\.?[Mm]\.?)?"
    r"|(?P<hour2>\d{1,2}):(?P<minute2>\d\d)\s?(?P<half2>[AaPp])\.?[Mm]\.?",
    re.ASCII,
)
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d(?::\d\d(?:\.\d{1,9})?)?(?:Z|[-+]\d\d:?\d\d)?", re.ASCII)
_SECOND = np.timedelta64(1, "s")
DAY = 86400.0  # [s]


def is_date_time(cell: str) -> bool:
    """Whether a cell looks like a date with a time: ISO 8601, 03/01/2024 1:05 PM, 01-Mar-2024 13:05:00."""
    return _match(cell) is not None


def is_time_of_day(cell: str) -> bool:
    """Whether a cell looks like a time of day, or a duration, with its seconds or with AM or PM."""
    return _OF_DAY.fullmatch(cell) is not None


def date_time(cell: str, day_first: bool | None = None) -> pd.Timestamp:
    """Return the time in a cell, in UTC unless it names a zone; ValueError for anything else.

    `day_first` is the order of dates such as 03/04/2024; without it they are refused unless only one order is possible.
    """
    match = _match(cell)
    with suppress(ValueError, KeyError, OverflowError):
        if match is not None:
            year, month, day = _date(match, day_first)
            zone = (match["zone"] or "").replace("UTC", "Z").replace("GMT", "Z")
            seconds = (match["second"] or "0").replace(",", ".").rjust(2, "0")[: len("00.123456789")]
            hour = _hour(int(match["hour"]), match["half"])
            return as_utc(f"{year:04d}-{month:02d}-{day:02d}T{hour:02d}:{match['minute']}:{seconds}{zone}")
    raise ValueError(f'"{shorten(cell)}" is not a date and time. Write year-month-day hour:minute:second.')


def as_utc(text: str) -> pd.Timestamp:
    """Return the time in a text as ISO 8601 writes it, in UTC unless it names a zone; ValueError for anything else."""
    time = pd.Timestamp(text)
    if not isinstance(time, pd.Timestamp):
        raise ValueError(text)
    return time.tz_localize("UTC") if time.tz is None else time.tz_convert("UTC")


def time_of_day(cell: str) -> float:
    """Return the seconds since midnight in a cell, or those of a duration; ValueError for anything else."""
    match = _OF_DAY.fullmatch(cell)
    with suppress(ValueError):
        if match is not None:
            hour, minute = int(match["hour"] or match["hour2"]), int(match["minute"] or match["minute2"])
            second = float((match["second"] or "0").replace(",", ".").replace(":", "."))
            if minute < 60 and second < 61:  # a leap second has a number of its own
                return 3600.0 * _hour(hour, match["half"] or match["half2"]) + 60.0 * minute + second
    raise ValueError(f'"{shorten(cell)}" is not a time of day. Write hour:minute:second.')


@dataclass(frozen=True)
class TextClock:
    """A column of dates with times, as seconds since its first one, or of times of day, as seconds since midnight."""

    first: str  # the first cell
    daily: bool
    day_first: bool | None = None
    only: str = ""  # the only date in a file whose dates may have either order

    @property
    def start(self) -> pd.Timestamp:
        """The first date and time; ValueError if it is none."""
        return date_time(self.first, self.day_first)

    @property
    def note(self) -> str:
        """What was made of the cells, in words."""
        if self.daily:
            return f"times of day, now seconds since midnight; the first is {self.first}"
        order = "" if self.only or self.day_first is None else ", the day first" if self.day_first else ", month first"
        return f"date-times, now seconds since {self.first}{order}"

    def number(self, cell: str) -> float:
        """Return the seconds of one cell; ValueError for anything else."""
        if self.daily:
            return time_of_day(cell)
        if self.only and not cell.startswith(self.only):
            raise ValueError(ambiguous(self.only))
        return (date_time(cell, self.day_first) - self.start) / _SECOND

    def numbers(self, cells: pd.Series) -> np.ndarray:
        """Return the seconds of many cells, NaN for missing ones; ValueError where one cell is anything else."""
        if self.daily or not _ISO.fullmatch(self.first):
            return cells.map(self.number, na_action="ignore").to_numpy(float)
        if (cells.str.len() < len("2024-01-01 00:00")).any():  # a year alone would pass, too
            raise ValueError
        return ((pd.to_datetime(cells, format="ISO8601", utc=True) - self.start) / _SECOND).to_numpy(float)


def clock_of(cells: Sequence[str], day_first: bool | None, field: str, file: str | None = None) -> TextClock:
    """Return the clock of a column by its first cells.

    Raises InputError for a first cell that is no time, and where the order of its dates cannot be known.
    """
    try:
        clock = _clock_of(cells, day_first)
        clock.number(cells[0])
    except ValueError as error:
        raise InputError(str(error), file=file, field=field) from None
    return clock


def _clock_of(cells: Sequence[str], day_first: bool | None) -> TextClock:
    if is_time_of_day(cells[0]):
        return TextClock(cells[0], daily=True)
    matches = [match for cell in cells if (match := _match(cell))]
    numbers = [(int(m["one"]), int(m["two"])) for m in matches if "one" in m.groupdict()]
    if not numbers or day_first is not None or matches[0]["sign"] == ".":
        return TextClock(cells[0], False, day_first if day_first is not None or not numbers else True)
    if any(max(pair) > 12 for pair in numbers):
        return TextClock(cells[0], False, any(one > 12 for one, _ in numbers))
    date = re.match(r"\d+\D\d+\D\d+", cells[0])
    if len(set(numbers)) > 1 or date is None:
        raise ValueError(ambiguous(date[0] if date else cells[0]))
    if numbers[0][0] == numbers[0][1]:
        return TextClock(cells[0], False, False)
    return TextClock(cells[0], False, False, only=date[0])  # within one day their order does not matter


def ambiguous(date: str) -> str:
    """Return the question which order the dates have."""
    return f"{date} may have the day or the month first. Write file: {{dates: day first}} or month first in a sheet."


def _match(cell: str) -> "re.Match[str] | None":
    return next((found for pattern in _DATE_TIME if (found := pattern.fullmatch(cell))), None)


def _date(found: "re.Match[str]", day_first: bool | None) -> tuple[int, int, int]:
    groups = found.groupdict()
    year = int(groups["year"]) + (2000 if len(groups["year"]) == 2 else 0)
    if "name" in groups:
        return year, _MONTHS[groups["name"][:3].lower()], int(groups["day"])
    if "one" not in groups:
        return year, int(groups["month"]), int(groups["day"])
    one, two = int(groups["one"]), int(groups["two"])
    if day_first is None and groups["sign"] != "." and max(one, two) <= 12 and one != two:
        raise ValueError
    day_is_first = one > 12 or groups["sign"] == "." if day_first is None else day_first
    return (year, two, one) if day_is_first else (year, one, two)


def _hour(hour: int, half: str | None) -> int:
    """Hour of the day from that of a clock with AM or PM; ValueError if it has no such hour."""
    if not half:
        return hour
    if not 1 <= hour <= 12:
        raise ValueError
    return hour % 12 + 12 * (half.lower() == "p")

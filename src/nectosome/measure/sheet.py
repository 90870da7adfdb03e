"""Sheets: YAML descriptions of measurement files: the column of each quantity, units, signs, zeros, gains."""

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from jaxtyping import Float
from pydantic import BeforeValidator, Field, PlainValidator, ValidationInfo, WithJsonSchema, model_validator

from nectosome.io.schema.described import Described, Shorthand, Text, unfit, wrong
from nectosome.io.schema.quantity import QuantitySource
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.units import read_any, scale_to_si, shorten
from nectosome.units.ranges import split_range

from .formats.clock_text import date_time
from .formats.source import Options

_COORDINATES = ("row", "repeat")
_SYMBOL = 2  # letters of a name up to which capitals count: F is a force, and f a frequency


def collision(columns: Iterable[str], conditions: Iterable[str], clocks: Iterable[str]) -> tuple[str, str] | None:
    """Return the field with the first name of a sheet that is not allowed, and why; None where all are.

    Names may not be those of coordinates, hold slashes, or differ from another one by capitals and blanks only.
    """
    groups = ("columns", columns), ("conditions", conditions)
    given = [(f"{group}.{name}", name) for group, names in groups for name in names]
    for field, name in given:
        if _plain(name).casefold() == "time":
            why = "the time has a field of its own, as in time: {column: time, unit: s}. Take it out of this group."
            return field, why
        if _plain(name).casefold() in _COORDINATES:
            return field, "has the name of a coordinate that recordings have. Give another."
        if not name.strip() or "/" in name:
            return field, "must be a name without slashes."
    for group in (given, [(f"clocks.{name}", name) for name in clocks]):
        seen: dict[str, tuple[str, str]] = {}
        for field, name in group:
            key = _plain(name) if len(_plain(name)) <= _SYMBOL else _plain(name).casefold()
            other, known = seen.setdefault(key, (field, name))
            if other != field:
                how = "has the name of" if name == known else "differs only by capitals or blanks from"
                return field, f"{how} {other}. Give another."
    return None


def _plain(name: str) -> str:
    return " ".join(name.split())


Repair = Literal["refuse", "drop", "shift"]
_DELIMITERS = {"tab": "\t", "comma": ",", "semicolon": ";", "blank": " ", "blanks": " "}
_QUANTITY = {"anyOf": [{"type": "string", "pattern": r"^\s*[-+]?(\d|\.\d)"}, {"type": "number"}]}


def _si(value: Any) -> tuple[float, str]:
    """A quantity of any kind, in SI, and its SI unit; from text, or as it is."""
    if isinstance(value, tuple):
        return value
    try:
        return read_any(str(value))
    except ValueError as error:
        raise unfit(str(error)) from None


def _column(value: Any) -> int | str:
    if isinstance(value, bool) or not isinstance(value, int | str) or (isinstance(value, int) and value < 1):
        raise unfit(f'"{shorten(value)}" is not a column: write a number from 1 or a name.')
    return value


def _unit(value: Any) -> str:
    try:
        scale_to_si(str(value))
    except ValueError as error:
        raise unfit(f'"{shorten(value)}" {error}.') from None
    return str(value)


def _time_unit(unit: str) -> str:
    if scale_to_si(_unit(unit))[2] != "s":
        raise unfit(f'"{shorten(unit)}" is not a unit of time, as in "ms".')
    return unit


def _rate(value: Any) -> float:
    if isinstance(value, float):
        return value
    rate, unit = _si(value)
    if unit not in ("Hz", "s-1") or not rate > 0:
        raise unfit(f'"{shorten(value)}" is not a rate, as in "1000 Hz".')
    return rate


def _header(value: Any) -> int:
    value = 0 if value == "none" else value
    if isinstance(value, bool) or not isinstance(value, int) or value < 0:
        raise unfit(f'"{shorten(value)}" is not a line: write a number from 1, or none.')
    return value


def _sign(value: Any) -> int:
    if value not in (1, -1) or isinstance(value, bool):
        raise unfit(f'"{shorten(value)}" must be 1 or -1.')
    return value


def _reading(value: Any, info: ValidationInfo) -> tuple[float, str | None]:
    """A value of the reading: in SI with its SI unit, or a bare number, which has the unit of the reading."""
    if not isinstance(info.context, QuantitySource):
        return value
    number, si = _si(value)
    if si == "" and _has_no_unit(value):
        return number, None
    unit = info.data.get("unit")
    if unit is not None and si != (needed := scale_to_si(unit)[2]):
        raise unfit(f'"{shorten(value)}" has not the dimension of the reading, {needed or "1"}.')
    return number, si


def _has_no_unit(value: Any) -> bool:
    return not str(value).strip().lstrip("+-.0123456789eE").strip()


def _delay(value: Any) -> float:
    if isinstance(value, float):
        return value
    number, unit = _si(value)
    if unit != "s":
        raise unfit(f'"{shorten(value)}" is not a time, as in "0.12 s" or "-40 ms".')
    return number


def _or_range(read: Callable[[Any], float]) -> Callable[[Any], Any]:
    """Reader of a number, or of the range of one that is unknown, as two numbers."""

    def of(value: Any) -> float | tuple[float, float]:
        if isinstance(value, tuple):
            return value
        parts = split_range(str(value))
        if parts is None:
            return read(value)
        if parts.step or parts.log:
            raise unfit(f'"{shorten(value)}" is no range of a clock. Write LOW..HIGH, as in "-30..30 ms".')
        low, high = read(parts.low), read(parts.high)
        if not low < high:
            raise unfit(f'"{shorten(value)}" is empty: its lower end must be less than its upper end.')
        return low, high

    return of


def _drift(value: Any) -> float:
    if isinstance(value, float):
        return value
    number, unit = _si(value)
    if unit or not abs(number) < 1:
        raise unfit(f'"{shorten(value)}" is no share by which a clock is fast, as in "0.1 %" or "-50 ppm".')
    return number


def _instant(value: Any) -> str:
    """A date and time as text; YAML makes its own type of some."""
    try:
        date_time(str(value))
    except ValueError as error:
        raise unfit(str(error)) from None
    return str(value)


def _error(value: Any, info: ValidationInfo) -> tuple[float, str | None]:
    """A standard error: a difference of readings, above 0."""
    if isinstance(info.context, QuantitySource) and scale_to_si(str(value).partition(" ")[2].strip())[1]:
        raise unfit(f'"{shorten(value)}" is a temperature and not a difference of two. Write it in K.')
    error = _reading(value, info)
    if isinstance(info.context, QuantitySource) and not error[0] > 0:
        raise unfit(f'"{shorten(value)}" is out of range: it must be more than 0.')
    return error


def _wrap(value: Any, info: ValidationInfo) -> tuple[float, str | None]:
    """A period of readings, above 0; 0 for the word none."""
    if value == "none":
        return 0.0, None
    wrap = _reading(value, info)
    if isinstance(info.context, QuantitySource) and not wrap[0] > 0:
        raise unfit(f'"{shorten(value)}" is out of range: it must be more than 0, or the word none.')
    return wrap


def _gain(value: Any) -> tuple[float, str]:
    if isinstance(value, tuple):
        return value
    number, _ = _si(value)
    if number == 0:
        raise unfit("is 0; it must differ from 0.")
    return number, str(value).partition(" ")[2].strip()


def _text(schema: dict[str, Any], *examples: Any) -> WithJsonSchema:
    return WithJsonSchema(schema | {"examples": list(examples)})


Column = Annotated[
    int | str, PlainValidator(_column), _text({"anyOf": [{"type": "integer", "minimum": 1}, {"type": "string"}]}, 2)
]
Unit = Annotated[str, PlainValidator(_unit), _text({"type": "string"}, "N", "mm", "V")]
TimeUnit = Annotated[str, PlainValidator(_time_unit), _text({"type": "string"}, "ms")]
SamplingRate = Annotated[float, PlainValidator(_rate), _text({"type": "string"}, "1000 Hz")]  # [Hz]
Header = Annotated[
    int, PlainValidator(_header), _text({"anyOf": [{"type": "integer", "minimum": 1}, {"const": "none"}]}, 1)
]
Sign = Annotated[int, PlainValidator(_sign), WithJsonSchema({"enum": [1, -1]})]
Reading = Annotated[tuple[float, str | None], BeforeValidator(_reading), _text(_QUANTITY, "0.31 V")]
Delay = Annotated[float, PlainValidator(_delay), _text(_QUANTITY, "0.12 s", "-40 ms")]  # [s]
_AS_RANGE = {"anyOf": [{"type": "string"}, {"type": "number"}]}
Lateness = Annotated[  # [s]
    float | tuple[float, float], BeforeValidator(_or_range(_delay)), _text(_AS_RANGE, "12 ms", "-30..30 ms")
]
Drift = Annotated[
    float | tuple[float, float], BeforeValidator(_or_range(_drift)), _text(_AS_RANGE, "0.1 %", "-0.2..0.2 %")
]
Instant = Annotated[str, PlainValidator(_instant), _text({"type": "string"}, "2024-03-01 12:00:00")]
Gain = Annotated[tuple[float, str], BeforeValidator(_gain), _text(_QUANTITY, "46.5 N/V")]
Condition = Annotated[tuple[float, str], BeforeValidator(_si), _text(_QUANTITY, "1.1 Hz", "20 deg")]


class FileLayout(Described):
    """What shall not be found out of a file; what is left out is found out."""

    encoding: Text | None = None
    """Encoding of a text, as in utf-8 or cp1252."""
    delimiter: Text | None = None
    """What stands between columns: `tab`, `comma`, `semicolon`, `blank`, or the sign itself."""
    decimal: Text | None = None
    """Decimal sign: a point or a comma."""
    header: Header | None = None
    """Line with the names of columns, from 1; `none` where there is none."""
    table: Text | None = None
    """Worksheet, group or variable that holds the table; section of a motion capture's file."""
    dates: Literal["day first", "month first"] | None = None
    """Order of the day and the month in dates such as 03/04/2024."""

    @property
    def options(self) -> Options:
        """The same, for the readers."""
        delimiter = _DELIMITERS.get(self.delimiter or "", self.delimiter)
        day_first = None if self.dates is None else self.dates == "day first"
        return Options(self.encoding, delimiter, self.decimal, self.header, self.table, day_first)


class SheetEntry(Described):
    """One column: quantity = sign * gain * (reading - zero)."""

    column: Column | None = None
    """Number of the column, from 1, or its name in the file; left out, the name is that of the quantity."""
    unit: Unit | None = None
    """Unit of the reading; left out, that of the file. Where both say one, this one holds."""
    sign: Sign = 1
    """1, or -1 for a sensor that counts the other way."""
    zero: Reading | None = None
    """Reading at which the quantity is 0. A bare number has the unit of the reading."""
    gain: Gain | None = None
    """Quantity per reading of a sensor, with its unit."""
    range: tuple[Reading, Reading] | None = None
    """Ends of the sensor; readings there or beyond are taken for saturated and become missing values."""
    wrap: Annotated[tuple[float, str | None], BeforeValidator(_wrap), _text(_QUANTITY, 4096, "360 deg")] | None = None
    """Period after which the readings start again, as an encoder's after a turn: they go on there instead. `none`: they
    do not. Left out, numbers of 16 and 32 bits and angles that start again go on, and what may be others is warned
    of."""
    error: Annotated[tuple[float, str | None], BeforeValidator(_error), _text(_QUANTITY, "0.5 mm")] | None = None
    """Standard error of the reading, where it is known. A bare number has the unit of the reading."""
    clock: str | None = None
    """Name of its clock, one of `clocks`; left out, it is that of the time."""
    about: str = ""
    """What the quantity is."""

    @model_validator(mode="after")
    def _range_fits(self) -> Self:
        if self.range is not None and self.range[0][1] == self.range[1][1] and self.range[0][0] >= self.range[1][0]:
            raise wrong("range", "is empty: its lower end must be less than its upper end.")
        return self


class Time(Described):
    """Source of the time: a column or a sampling rate; `none` in its place where a file has no time."""

    column: Column | None = None
    """Number of the column, from 1, or its name in the file."""
    unit: TimeUnit | None = None
    """Unit of that column; left out, that of the file."""
    rate: SamplingRate | None = None
    """Sampling rate, where no column has the time."""
    repair: Repair = "refuse"
    """What becomes of rows whose time does not increase: the file is refused, they are left out, or the clock counts
    on from there by its usual interval, as if it had not been set back."""
    offset: Delay = 0.0
    """What is added to the time: the delay of a device whose clock was started late, less than 0 for one too early."""
    since: Instant | None = None
    """Date and time (UTC) at which the time is 0, for clocks with a date; left out, the first sample. So recordings of
    several devices keep one clock."""

    @property
    def absent(self) -> bool:
        """Whether the file has no time."""
        return self.column is None and self.rate is None


NO_TIME = Time()


class DeviceClock(Time):
    """A clock of a device: a column of times or a sampling rate of its own, else it has the times of the recording."""

    shift: Lateness = 0.0
    """How much later it is than the time of the recording: a time, or the range of what `identify` shall find. Where
    the campaign says it, that is one for all recordings; where a recording does, it is its own."""
    drift: Drift = 0.0
    """Share by which it runs fast, less than 0 for a slow one: a number, or a range likewise. A camera's 29.97 frames/s
    taken for 30 make it slow: -0.1 %."""

    @property
    def is_known(self) -> bool:
        """Whether nothing of it is to be found."""
        return not isinstance(self.shift, tuple) and not isinstance(self.drift, tuple)

    @property
    def is_right(self) -> bool:
        """Whether times are left as they are: it is not late, or by how much is to be found."""
        return not self.is_known or (self.shift, self.drift) == (0, 0)

    def times(self, time: Float[np.ndarray, "n"], first: float) -> Float[np.ndarray, "n"]:
        """Times on the clock of the recording, which begins at `first`; as they are where a fit finds that."""
        if self.is_right or isinstance(self.shift, tuple) or isinstance(self.drift, tuple):
            return time
        return first + (time - first - self.shift) / (1 + self.drift)

    def found(self, name: str) -> list[str]:
        """What is done with its lateness, in words."""
        if not self.is_known:
            return [f"clocks.{name}: a fit finds its shift and drift; they are not taken off here"]
        if self.is_right:
            return []
        return [f"clocks.{name}: late by {self.shift:g} s and fast by {100 * self.drift:g} %: taken off"]


class _TimeOrColumn(Shorthand):
    """A source of time that may be written as its column, or as `none`."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        value = NO_TIME if value == "none" else _as_column(value)
        if isinstance(value, dict) and ("column" in value) == ("rate" in value):
            raise unfit("needs either a column or a rate, or the word none.")
        return value

    def shorten(self, row: list[Any]) -> Any:
        """Nothing: sheets are not written."""
        return row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of a column."""
        return {"type": ["integer", "string"]}


class Split(Described):
    """A file with several recordings one below the other: the column that says of which one a row is."""

    column: Column
    """Number of the column, from 1, or its name in the file. It may be text in text files and worksheets."""
    value: Text | None = None
    """The only value that is taken; left out, each value is a recording."""


class _ClockOrColumn(_TimeOrColumn):
    """A clock that may be written as its column."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        if value == "none":
            raise unfit("needs either a column or a rate.")
        value = _as_column(value)
        return value if isinstance(value, dict) and value.keys() <= {"shift", "drift"} else super().expand(value)


class _EntryOrColumn(_TimeOrColumn):
    """An entry that may be written as its column."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        return _as_column(value)


def _as_column(value: Any) -> Any:
    return {"column": value} if isinstance(value, int | str) else value


class SourceFields(Described):
    """What a sheet and each recording of a campaign may say of a file."""

    split: Annotated[Split, _EntryOrColumn()] | None = None
    """Column by which a file is split into recordings, as in `split: trial`."""
    time: Annotated[Time, _TimeOrColumn()] | None = None
    """Source of the time: a column, a sampling rate, or `none`. Left out, it is the column called time or the like."""
    clocks: dict[str, Annotated[DeviceClock, _ClockOrColumn()]] = Field(default_factory=dict)
    """Clocks of other devices in the same file, by name; `clock: camera` beside a column says that it has that one.
    Its readings are resampled at the times of the recording. `camera: {}` has these times, and may be late."""
    columns: dict[str, Annotated[SheetEntry, _EntryOrColumn()]] = Field(default_factory=dict)
    """Quantities by name, each with its column; left out, all columns are taken as they are."""
    conditions: dict[str, Condition] = Field(default_factory=dict)
    """What was the same all the time, by name: `{f: 1.1 Hz, A: 20 deg}`."""

    @model_validator(mode="after")
    def _names_differ(self) -> Self:
        same = collision(self.columns, self.conditions, self.clocks)
        if same is not None:
            raise wrong(*same)
        return self


class FileRepair(Described):
    """What is mended of a file."""

    rows: Literal["refuse", "drop"] = "refuse"
    """What becomes of lines of a text that were cut, or hold words among numbers, as after the restart of a board: the
    file is refused, or they are left out and counted."""


class Sheet(SourceFields):
    """A sheet: what a file of measurements does not say of itself."""

    about: str = ""
    """What was measured, in sentences."""
    file: FileLayout = FileLayout()
    """How the file is laid out, where that shall not be found out."""
    repair: FileRepair = FileRepair()
    """What is mended of it, as in `repair: {rows: drop}`."""


def load_sheet(path: str | Path) -> Sheet:
    """Read a sheet. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    return validate_as(Sheet, data, "sheet", file=source, lines=lines)

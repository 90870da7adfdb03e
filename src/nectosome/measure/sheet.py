"""Sheets: YAML descriptions of measurement files: the column of each quantity, units, signs, zeros, gains."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any, Literal, Self

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from nectosome.io.schema.described import Described, Shorthand, Text, unfit, wrong
from nectosome.io.schema.validate import validate_as
from nectosome.io.yaml_text import read_text, read_yaml

from . import sheet_values as values
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


class FileLayout(Described):
    """What shall not be found out of a file; what is left out is found out."""

    encoding: Text | None = None
    """Encoding of a text, as in utf-8 or cp1252."""
    delimiter: Text | None = None
    """What stands between columns: `tab`, `comma`, `semicolon`, `blank`, or the sign itself."""
    decimal: Text | None = None
    """Decimal sign: a point or a comma."""
    header: values.Header | None = None
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

    column: values.Column | None = None
    """Number of the column, from 1, or its name in the file; left out, the name is that of the quantity."""
    unit: values.Unit | None = None
    """Unit of the reading; left out, that of the file. Where both say one, this one holds."""
    sign: values.Sign = 1
    """1, or -1 for a sensor that counts the other way."""
    zero: values.Reading | None = None
    """Reading at which the quantity is 0. A bare number has the unit of the reading."""
    at_rest: tuple[values.Stretch, ...] = ()
    """Stretches of time at which the quantity is 0, from the first sample on, or less than 0 from the last one back:
    their means are taken off, with a straight line between them for a sensor that drifts."""
    notch: values.Frequencies = ()
    """Frequency of hum, as 50 Hz of the mains, or several: what the readings have of it is taken off."""
    gain: values.Gain | None = None
    """Quantity per reading of a sensor, with its unit."""
    range: tuple[values.Reading, values.Reading] | None = None
    """Ends of the sensor; readings there or beyond are taken for saturated and become missing values."""
    wrap: values.Period | None = None
    """Period after which the readings start again, as an encoder's after a turn: they go on there instead, as a signed
    number where the period is no turn and they fit. `none`: they do not start again. Left out, numbers of 16, 24 and 32
    bits and angles go on, and what may be others is warned of."""
    error: values.StandardError | None = None
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

    column: values.Column | None = None
    """Number of the column, from 1, or its name in the file."""
    unit: values.TimeUnit | None = None
    """Unit of that column; left out, that of the file."""
    rate: values.SamplingRate | None = None
    """Sampling rate, where no column has the time."""
    repair: Repair = "refuse"
    """What becomes of rows whose time does not increase: the file is refused, they are left out, or the clock, which
    was set back, counts on from there after the time that `host` or `gap` tells."""
    host: values.Column | None = None
    """Number or name of a column with the times of a clock that went on, as of the computer that wrote the lines."""
    gap: values.Gap | None = None
    """Time from the last sample before a clock was set back to the first one after, where no other clock tells."""
    offset: values.Delay = 0.0
    """What is added to the time: the delay of a device whose clock was started late, less than 0 for one too early."""
    since: values.Instant | None = None
    """Date and time (UTC) at which the time is 0, for clocks with a date; left out, the first sample. So recordings of
    several devices keep one clock."""
    trigger: Text | None = None
    """Quantity of a pulse that several devices see: the time is 0 where it first rises through the middle of its range.
    Of two values it rises anywhere between two samples."""

    @model_validator(mode="after")
    def _tells_one_gap(self) -> Self:
        for field in ("host", "gap"):
            if getattr(self, field) is not None and self.repair != "shift":
                raise wrong(field, "is for a clock that was set back. Write repair: shift, too.")
        if self.host is not None and self.gap is not None:
            raise wrong("gap", "is what the column of host tells. Leave one of them out.")
        return self

    @property
    def absent(self) -> bool:
        """Whether the file has no time."""
        return self.column is None and self.rate is None


NO_TIME = Time()


class DeviceClock(Time):
    """A clock of a device: a column of times or a sampling rate of its own, else it has the times of the recording."""

    shift: values.Lateness = 0.0
    """How much later it is than the time of the recording: a time, or the range of what `identify` shall find. Where
    the campaign says it, that is one for all recordings; where a recording does, it is its own."""
    drift: values.Drift = 0.0
    """Share by which it runs fast, less than 0 for a slow one: a number, or a range likewise. A camera's 29.97 frames/s
    taken for 30 make it slow: -0.1 %."""

    @model_validator(mode="after")
    def _has_no_trigger(self) -> Self:
        if self.trigger is not None:
            raise wrong("trigger", "is of the time of a file. A device with a file of its own stands under `beside`.")
        return self

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


class _OrColumn(Shorthand):
    """What may be written as its column."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        return {"column": value} if isinstance(value, int | str) else value

    def shorten(self, row: list[Any]) -> Any:
        """Nothing: sheets are not written."""
        return row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of a column."""
        return {"type": ["integer", "string"]}


class _TimeOrColumn(_OrColumn):
    """A source of time that may be written as its column, or as `none`."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        value = NO_TIME if value == "none" else super().expand(value)
        if isinstance(value, dict) and ("column" in value) == ("rate" in value):
            raise unfit("needs either a column or a rate, or the word none.")
        return value


class _ClockOrColumn(_TimeOrColumn):
    """A clock that may be written as its column."""

    def expand(self, value: Any) -> Any:
        """Put a column into its group."""
        if value == "none":
            raise unfit("needs either a column or a rate.")
        is_late_only = isinstance(value, dict) and value.keys() <= {"shift", "drift"}
        return value if is_late_only else super().expand(value)


class Split(Described):
    """A file with several recordings one below the other: the column that says of which one a row is."""

    column: values.Column
    """Number of the column, from 1, or its name in the file. It may be text in text files and worksheets."""
    value: Text | None = None
    """The only value that is taken; left out, each value is a recording."""


class TimedColumns(Described):
    """Time and columns of a file."""

    time: Annotated[Time, _TimeOrColumn()] | None = None
    """Source of the time: a column, a sampling rate, or `none`. Left out, it is the column called time or the like."""
    columns: dict[str, Annotated[SheetEntry, _OrColumn()]] = Field(default_factory=dict)
    """Quantities by name, each with its column; left out, all columns are taken as they are."""


class SourceFields(TimedColumns):
    """What a sheet and each recording of a campaign may say of a file."""

    split: Annotated[Split, _OrColumn()] | None = None
    """Column by which a file is split into recordings, as in `split: trial`."""
    clocks: dict[str, Annotated[DeviceClock, _ClockOrColumn()]] = Field(default_factory=dict)
    """Clocks of other devices in the same file, by name; `clock: camera` beside a column says that it has that one.
    Its readings are resampled at the times of the recording. `camera: {}` has these times, and may be late."""
    conditions: dict[str, values.Condition] = Field(default_factory=dict)
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

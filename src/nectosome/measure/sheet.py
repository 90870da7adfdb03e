"""Sheets: YAML descriptions of measurement files: the column of each quantity, units, signs, zeros, gains."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.units import InputError, did_you_mean, read_any, shorten, unit_to_si

from .formats.source import Options

Repair = Literal["refuse", "drop"]


@dataclass(frozen=True)
class SheetEntry:
    """One column: quantity = sign * gain * (reading - zero); readings at or beyond `range` count as saturated."""

    column: int | str | None = None  # number from 1, or name in the file; None: the name of the entry
    unit: str | None = None  # of the reading; None: that of the file
    sign: int = 1
    zero: float = 0.0  # [SI of the reading]
    gain: tuple[float, str] | None = None  # [SI], and its unit as written
    range: tuple[float, float] | None = None  # [SI of the reading]
    about: str = ""


@dataclass(frozen=True)
class Time:
    """Source of the time: a column, a sampling rate, or none (`absent`)."""

    column: int | str | None = None
    unit: str | None = None
    rate: float | None = None  # [Hz]
    repair: Repair = "refuse"  # of rows whose time does not increase
    absent: bool = False


@dataclass(frozen=True)
class Sheet:
    """Content of a sheet; without `columns`, all columns of a file are read as they are."""

    about: str = ""
    options: Options = field(default_factory=Options)
    time: Time | None = None
    columns: Mapping[str, SheetEntry] = field(default_factory=dict)
    conditions: Mapping[str, tuple[float, str]] = field(default_factory=dict)  # [SI] and SI unit
    source: str = ""


def load_sheet(path: str | Path) -> Sheet:
    """Read a sheet. Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    return parse_sheet(data, lines, source)


def parse_sheet(data: Any, lines: Mapping[Key, int], source: str, also: tuple[str, ...] = ()) -> Sheet:
    """Sheet of plain data; fields in `also` are allowed and ignored. Raises InputError."""
    r = _Reader(data, lines, source)
    top = r.group((), data, ("about", "file", "time", "columns", "conditions", *also))
    columns = r.group(("columns",), top.get("columns") or {}, None)
    conditions = r.group(("conditions",), top.get("conditions") or {}, None)
    return Sheet(
        about=str(top.get("about", "")),
        options=r.options(top.get("file")),
        time=r.time(top["time"]) if "time" in top else None,
        columns={name: r.entry(name, value) for name, value in columns.items()},
        conditions={name: r.value(("conditions", name), value) for name, value in conditions.items()},
        source=source,
    )


class _Reader:
    """Reads the parts of a sheet; errors name the line."""

    def __init__(self, data: Any, lines: Mapping[Key, int], source: str):
        self.lines, self.source = lines, source
        if not isinstance(data, dict):
            raise InputError("is not a sheet: it has no named fields.", file=source)

    def wrong(self, at: Key, message: str) -> InputError:
        line = next((self.lines[at[:n]] for n in range(len(at), -1, -1) if at[:n] in self.lines), None)
        return InputError(message, file=self.source, line=line, field=shorten(".".join(map(str, at))) or None)

    def group(self, at: Key, data: Any, known: tuple[str, ...] | None) -> dict[str, Any]:
        if not isinstance(data, dict):
            raise self.wrong(at, f'"{shorten(data)}" has no named fields.')
        for name in data:
            if known is not None and name not in known:
                raise self.wrong((*at, str(name)), f"is not a field here.{did_you_mean(str(name), known)}")
        return {str(name): value for name, value in data.items()}

    def options(self, data: Any) -> Options:
        if data is None:
            return Options()
        given = self.group(("file",), data, ("encoding", "delimiter", "decimal", "header", "table"))
        header = given.get("header")
        if header == "none":
            given["header"] = header = 0
        if header is not None and (isinstance(header, bool) or not isinstance(header, int) or header < 0):
            raise self.wrong(("file", "header"), f'"{shorten(header)}" is not a line: write a number from 1, or none.')
        for name in ("encoding", "delimiter", "decimal", "table"):
            if name in given:
                given[name] = str(given[name])
        given["delimiter"] = _DELIMITERS.get(given.get("delimiter", ""), given.get("delimiter"))
        return Options(**given)

    def time(self, data: Any) -> Time:
        if data is None or data == "none":
            return Time(absent=True)
        if not isinstance(data, dict):
            data = {"column": data}
        given = self.group(("time",), data, ("column", "unit", "rate", "repair"))
        if ("rate" in given) == ("column" in given):
            raise self.wrong(("time",), "needs either a column or a rate, or the word none.")
        if given.get("repair", "refuse") not in ("refuse", "drop"):
            raise self.wrong(("time", "repair"), f'"{shorten(given["repair"])}" must be refuse or drop.')
        rate = None
        if "rate" in given:
            rate, unit = self.value(("time", "rate"), given["rate"])
            if unit not in ("Hz", "s-1") or not rate > 0:
                raise self.wrong(("time", "rate"), f'"{shorten(given["rate"])}" is not a rate, as in "1000 Hz".')
        unit = self.unit(("time", "unit"), given.get("unit"))
        if unit is not None and unit_to_si(unit)[1] != "s":
            raise self.wrong(("time", "unit"), f'"{shorten(unit)}" is not a unit of time, as in "ms".')
        return Time(self.column(("time",), given.get("column")), unit, rate, given.get("repair", "refuse"))

    def entry(self, name: str, data: Any) -> SheetEntry:
        at = ("columns", name)
        if data is None or isinstance(data, int | str):
            data = {"column": data}
        given = self.group(at, data, ("column", "unit", "sign", "zero", "gain", "range", "about"))
        sign = given.get("sign", 1)
        if sign not in (1, -1) or isinstance(sign, bool):
            raise self.wrong((*at, "sign"), f'"{shorten(sign)}" must be 1 or -1.')
        unit = self.unit((*at, "unit"), given.get("unit"))
        zero = self.of_reading((*at, "zero"), given["zero"], unit) if "zero" in given else 0.0
        limits = None
        if "range" in given:
            ends = given["range"]
            if not isinstance(ends, list) or len(ends) != 2:
                raise self.wrong((*at, "range"), "needs two values, as in [-5 V, 5 V].")
            low, high = (self.of_reading((*at, "range"), end, unit) for end in ends)
            if not low < high:
                raise self.wrong((*at, "range"), "is empty: its lower end must be less than its upper end.")
            limits = (low, high)
        gain = None
        if "gain" in given:
            number, _ = self.value((*at, "gain"), given["gain"])
            gain = (number, str(given["gain"]).partition(" ")[2].strip())
            if number == 0:
                raise self.wrong((*at, "gain"), "is 0; it must differ from 0.")
            if unit is None and gain[1]:
                raise self.wrong((*at, "gain"), "needs the unit of the reading beside it, as in unit: V.")
        return SheetEntry(
            self.column(at, given.get("column")), unit, sign, zero, gain, limits, str(given.get("about", ""))
        )

    def column(self, at: Key, value: Any) -> int | str | None:
        if isinstance(value, bool) or (isinstance(value, int) and value < 1):
            raise self.wrong((*at, "column"), f'"{shorten(value)}" is not a column: write a number from 1 or a name')
        return value if value is None or isinstance(value, int) else str(value)

    def unit(self, at: Key, value: Any) -> str | None:
        if value is None:
            return None
        try:
            unit_to_si(str(value))
        except ValueError as error:
            raise self.wrong(at, f'"{shorten(value)}" {error}.') from None
        return str(value)

    def value(self, at: Key, value: Any) -> tuple[float, str]:
        try:
            return read_any(str(value))
        except ValueError as error:
            raise self.wrong(at, str(error)) from None

    def of_reading(self, at: Key, value: Any, unit: str | None) -> float:
        """A value in the unit of the reading; a bare number has that unit."""
        number, si = self.value(at, value)
        factor, expected = unit_to_si(unit or "")
        if si == "" and expected:
            return number * factor
        if si != expected:
            raise self.wrong(at, f'"{shorten(value)}" has not the dimension of the reading, {unit or "1"}.')
        return number


_DELIMITERS = {"tab": "\t", "comma": ",", "semicolon": ";", "blank": " ", "blanks": " "}

"""Values in sheets: columns, units, readings, times, stretches and lateness of clocks, as text or numbers."""

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import BeforeValidator, PlainValidator, ValidationInfo, WithJsonSchema

from nectosome.io.schema.described import unfit
from nectosome.io.schema.quantity import QuantitySource
from nectosome.units import read_any, scale_to_si, shorten
from nectosome.units.ranges import split_range

from .formats.clock_text import date_time

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


def _frequencies(value: Any) -> Any:
    """One frequency, or several: a list."""
    return value if isinstance(value, list | tuple) else [value]


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


def _gap(value: Any) -> float:
    gap = _delay(value)
    if not gap > 0:
        raise unfit(f'"{shorten(value)}" is out of range: it must be more than 0 s.')
    return gap


def _or_range(read: Callable[[Any], float]) -> Callable[[Any], Any]:
    """Reader of a number, or of the range of one that is unknown, as two numbers; from text, or as they are."""

    def of(value: Any) -> float | tuple[float, float]:
        parts = None if isinstance(value, tuple | list) else split_range(str(value))
        ends = parts[:2] if parts else value
        if not isinstance(ends, tuple | list):
            return read(value)
        if len(ends) != 2 or (parts and (parts.step or parts.log)):
            raise unfit(f'"{shorten(value)}" is no range of a clock. Write LOW..HIGH, as in "-30..30 ms".')
        low, high = map(read, ends)
        if not low < high:
            raise unfit(f'"{shorten(value)}" is empty: its lower end must be less than its upper end.')
        return low, high

    return of


read_shift = _or_range(_delay)  # of a clock [s]


def _stretch(value: Any) -> tuple[float, float]:
    """A stretch of time, as two times."""
    stretch = read_shift(value)
    if not isinstance(stretch, tuple):
        raise unfit(f'"{shorten(value)}" is no stretch of time. Write LOW..HIGH, as in "0..1.4 s".')
    return stretch


def _drift(value: Any) -> float:
    if isinstance(value, float):
        return value
    number, unit = _si(value)
    if unit or not abs(number) < 1:
        raise unfit(f'"{shorten(value)}" is no share by which a clock is fast, as in "0.1 %" or "-50 ppm".')
    return number


read_drift = _or_range(_drift)  # share by which a clock is fast


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
Frequencies = Annotated[  # [Hz]
    tuple[SamplingRate, ...],
    BeforeValidator(_frequencies),
    _text(
        {"anyOf": [{"type": "string"}, {"type": "array", "items": {"type": "string"}}]}, "50 Hz", ["50 Hz", "100 Hz"]
    ),
]
Header = Annotated[
    int, PlainValidator(_header), _text({"anyOf": [{"type": "integer", "minimum": 1}, {"const": "none"}]}, 1)
]
Sign = Annotated[int, PlainValidator(_sign), WithJsonSchema({"enum": [1, -1]})]
Reading = Annotated[tuple[float, str | None], BeforeValidator(_reading), _text(_QUANTITY, "0.31 V")]
Delay = Annotated[float, PlainValidator(_delay), _text(_QUANTITY, "0.12 s", "-40 ms")]  # [s]
Gap = Annotated[float, PlainValidator(_gap), _text(_QUANTITY, "0.28 s")]  # [s]
_AS_RANGE = {"anyOf": [{"type": "string"}, {"type": "number"}]}
Lateness = Annotated[  # [s]
    float | tuple[float, float], BeforeValidator(read_shift), _text(_AS_RANGE, "12 ms", "-30..30 ms")
]
Drift = Annotated[float | tuple[float, float], BeforeValidator(read_drift), _text(_AS_RANGE, "0.1 %", "-0.2..0.2 %")]
Instant = Annotated[str, PlainValidator(_instant), _text({"type": "string"}, "2024-03-01 12:00:00")]
Gain = Annotated[tuple[float, str], BeforeValidator(_gain), _text(_QUANTITY, "46.5 N/V")]
Condition = Annotated[tuple[float, str], BeforeValidator(_si), _text(_QUANTITY, "1.1 Hz", "20 deg")]
Stretch = Annotated[
    tuple[float, float], BeforeValidator(_stretch), _text({"type": "string"}, "0..1.4 s", "-0.3..0 s")
]  # [s]
Period = Annotated[tuple[float, str | None], BeforeValidator(_wrap), _text(_QUANTITY, 4096, "360 deg")]
StandardError = Annotated[tuple[float, str | None], BeforeValidator(_error), _text(_QUANTITY, "0.5 mm")]

"""Numbers in lines of text: what they say, counts of a converter or a quantity in a unit, and how a command is one."""

import math
import re
from dataclasses import dataclass
from string import Formatter
from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from nectosome.io.schema.described import Described, unfit
from nectosome.units import InputError, scale_to_si, shorten, show_span, show_value

from ..device_files import AnyQuantity, FileFields, same_unit, slope_per
from ..rig import RigError

_SLOPE = 'Something per count is expected, as in "4.7 uN/count" or "0.1 deg/count".'
_DECIMALS = re.compile(r"[+ ]?0?\d{0,2}\.\d{1,2}f")  # no exponent: many boards read 1e-05 as 1


def _slope(value: Any) -> str:
    """The text of a slope."""
    try:
        slope_per("count", str(value), _SLOPE)
    except InputError as error:
        raise unfit(error.message) from None
    return str(value)


def _unit(value: Any) -> str:
    """The text of a unit; 1 is that of a number."""
    try:
        scale_to_si(str(value))
    except ValueError as error:
        raise unfit(f'"{shorten(value)}" {error}. A unit expected, as in "N" or "deg"; "1" without one.') from None
    return str(value)


def command_text(value: Any) -> str:
    """A text with one place for a number, which ends with a line feed. Raises InputError."""
    example = 'One place for the number is expected, as in "A{:.1f}".'
    text, shown = str(value), f'"{shorten(value)}"'
    if "\\n" in text or "\\r" in text:
        raise InputError(f"{shown} has a backslash: YAML reads line feeds in double quotes only. Leave it out.")
    if not text.isascii():
        raise InputError(f"{shown} has letters beyond ASCII.")
    try:
        places = [part[1:] for part in Formatter().parse(text) if part[1] is not None]
    except ValueError as error:
        raise InputError(f"{shown}: {str(error).rstrip('.')}. {example}") from None
    if len(places) != 1:
        raise InputError(f"{shown} has {len(places)} places in braces. {example}")
    ((name, decimals, conversion),) = places
    if name or conversion or not _DECIMALS.fullmatch(decimals or ""):
        raise InputError(f'{shown}: only decimals stand in the braces, as in "A{{:.1f}}" or, without any, "A{{:.0f}}".')
    return text if text.endswith("\n") else text + "\n"


def _command_text(value: Any) -> str:
    try:
        return command_text(value)
    except InputError as error:
        raise unfit(error.message) from None


CommandText = Annotated[
    str, PlainValidator(_command_text), WithJsonSchema({"type": "string", "examples": ["A{:.1f}", "M{:.0f}"]})
]


class ScaleFields(Described):
    """What a number in a line of text says."""

    unit: Annotated[str, PlainValidator(_unit), WithJsonSchema({"type": "string", "examples": ["deg", "N"]})] | None = (
        None
    )
    """Unit of the number, where it is a quantity already; else give a slope."""
    slope: (
        Annotated[str, PlainValidator(_slope), WithJsonSchema({"type": "string", "examples": ["4.7 uN/count"]})] | None
    ) = None
    """Quantity per count, where the number is one of counts."""
    zero: AnyQuantity = "0"
    """The number where the quantity is 0, in its unit, or in counts."""
    low: AnyQuantity | None = None
    """Smallest number that is one, in its unit, or in counts."""
    high: AnyQuantity | None = None
    """Largest number that is one, in its unit, or in counts."""


@dataclass(frozen=True)
class TextScale:
    """A quantity [unit, of SI] by a number in a line of text: slope (number - zero), for numbers within low and high.

    - printed_zero: the quantity that is printed as a number 0, where the text has a unit; None for counts.
    """

    slope: float
    unit: str
    zero: float = 0.0
    low: float = -math.inf
    high: float = math.inf
    printed_zero: float | None = None

    @classmethod
    def of(cls, given: ScaleFields, file: FileFields) -> "TextScale":
        """That of a file. Raises InputError."""
        if (given.unit is None) == (given.slope is None):
            raise file.wrong('give either a unit, as in "deg", or a slope, as in "4.7 uN/count".', "slope")
        if given.slope is not None:
            (slope, unit), shift, raw = slope_per("count", given.slope, _SLOPE), None, "count"
        else:
            slope, shift, unit = scale_to_si(given.unit or "")
            raw = unit
        if not 0 < abs(slope) < math.inf:
            raise file.wrong(f"{given.slope}; a finite number beside 0 expected.", "slope")
        numbers: dict[str, float] = {}
        for name in ("zero", "low", "high"):
            text = getattr(given, name)
            if text is None:
                continue
            try:
                read = same_unit(text, raw, difference=name == "zero")
            except ValueError as error:
                raise file.wrong(str(error), name) from None
            numbers[name] = read if shift is None else (read - shift) / slope
        scale = cls(slope, unit, **numbers, printed_zero=shift)
        if not scale.low < scale.high:
            raise file.wrong(f"{given.low}, and high is {given.high}: the range is empty.", "low")
        return scale

    def check_rest(self) -> None:
        """Check that a command of 0 is within the range. Raises InputError."""
        if not self.low <= self.zero <= self.high:
            raise InputError(
                f"a command of 0 would be sent as {self.zero:g}, which is not within {self.low:g} to {self.high:g}.",
                field="zero",
            )

    def quantity(self, number: float) -> float:
        """Measurement of a number in its SI unit; NaN out of its range."""
        return self.slope * (number - self.zero) if self.low <= number <= self.high else math.nan

    def number(self, command: float) -> float:
        """The number for a command in its SI unit. Raises RigError out of its range."""
        number = self.zero + command / self.slope
        rounding = 1e-9 * max(abs(end) for end in (self.zero, self.low, self.high) if math.isfinite(end))
        if not (math.isfinite(number) and self.low - rounding <= number <= self.high + rounding):
            low, high = sorted((end - self.zero) * self.slope for end in (self.low, self.high))
            raise RigError(
                f"a command of {show_value(command, self.unit)} would be sent as {number:g}, which is not within "
                f"{self.low:g} to {self.high:g}. Keep commands within {show_span(low, high, self.unit)}."
            )
        return min(max(number, self.low), self.high)

    @property
    def zero_in_file(self) -> tuple[float, float, str, bool]:
        """Zero, slope and unit of it as a file has them, and whether it has the slope."""
        if self.printed_zero is None:
            return self.zero, self.slope, "count", True
        return self.slope * self.zero + self.printed_zero, 1.0, self.unit, False

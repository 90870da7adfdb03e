"""Fields that carry a physical quantity: text with a unit in a file, an SI float in Python, a range either way."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from pydantic import BaseModel, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo
from pydantic_core import PydanticCustomError, core_schema

from nectosome.units import DIMENSIONS, expected, format_quantity, in_dimension, parse_quantity, shorten
from nectosome.units.ranges import SpreadText, split_spread

_WITH_SPREAD = r"\+-|±"
_WITH_UNIT = r"^\s*[-+]?(\d+\.?\d*|\.\d+)([eE][-+]?\d+)?\s*\D"


class QuantitySource(NamedTuple):
    """Validation context of text from people: a bare number is refused where a unit is needed."""

    folder: Path = Path()  # to which names of other files are relative
    most_rows: int = 20_000  # of a recording


class Si(float):
    """A number in SI units among text from people; with a `unit`, only of a quantity that has this unit."""

    unit: str | None

    def __new__(cls, value: float, unit: str | None = None) -> "Si":
        """A number; without a unit it is one of any quantity."""
        made = super().__new__(cls, value)
        made.unit = unit
        return made


class Uncertain(Si):
    """A number that is known to within `plus_minus`: half the width of its 95 % interval, in its unit.

    Numbers that share value and spread differ together, as what is made of one batch; those of `each` on their own, as
    what is built one by one. Turned, mirrored and shifted it stays uncertain; any other result of it is a plain float.
    """

    plus_minus: float
    each: bool

    def __new__(cls, value: float, plus_minus: float = 0.0, each: bool = False) -> "Uncertain":
        """A number with its spread."""
        made = float.__new__(cls, value)
        made.unit, made.plus_minus, made.each = None, plus_minus, each
        return made

    def __neg__(self) -> "Uncertain":
        return Uncertain(-float(self), self.plus_minus, self.each)

    def __mul__(self, other: Any) -> Any:
        if isinstance(other, Uncertain):
            return float(self) * float(other)
        if type(other) not in (int, float):
            return float(self) * other
        return Uncertain(float(self) * other, abs(other) * self.plus_minus, self.each) if other else 0.0 * float(self)

    def __add__(self, other: Any) -> Any:
        if isinstance(other, Uncertain):
            spread = math.hypot(self.plus_minus, other.plus_minus)
            return Uncertain(float(self) + float(other), spread, self.each or other.each)
        if type(other) not in (int, float):
            return float(self) + other
        return Uncertain(float(self) + other, self.plus_minus, self.each)

    def __sub__(self, other: Any) -> Any:
        return self + -other

    def __rsub__(self, other: Any) -> Any:
        return -self + other

    __rmul__, __radd__ = __mul__, __add__


@dataclass(frozen=True)
class Quantity:
    """Marks a float as a quantity of `dimension` (a key of `DIMENSIONS`) between `minimum` and `maximum` [SI].

    `exclusive` leaves the minimum itself out. What follows from a `fixed` one is worked out when a file is read: it
    does not vary.
    """

    dimension: str
    minimum: float | None = None
    maximum: float | None = None
    exclusive: bool = False
    fixed: bool = False

    @property
    def unit(self) -> str:
        """The SI unit, such as `Pa`; empty for a plain number."""
        return DIMENSIONS[self.dimension].unit

    def read(self, value: Any, *, units_required: bool) -> float:
        """Return the SI float of text or of a number; ValueError says what is wrong and what is expected.

        Text such as `1.2 +- 0.1 MPa` gives an `Uncertain` one.
        """
        spread = split_spread(value) if isinstance(value, str) else None
        if spread is not None:
            return self._read_spread(spread, str(value))
        if isinstance(value, Uncertain):
            number = value
        elif isinstance(value, str):
            number = parse_quantity(value, self.dimension)
        elif isinstance(value, Si) and value.unit is not None:
            number = in_dimension(float(value), value.unit, self.dimension)
        elif isinstance(value, bool) or not isinstance(value, int | float):
            raise ValueError(f"{given(value)} is no quantity. {expected(self.dimension)}")
        else:
            try:
                number = float(value)
            except OverflowError:
                number = math.inf
            if not math.isfinite(number):
                raise ValueError(f'"{shorten(number)}" must be finite. {expected(self.dimension)}')
            if units_required and number != 0 and self.unit and not isinstance(value, Si):
                raise ValueError(f'"{shorten(value)}" has no unit. {expected(self.dimension)}')
        self._check_range(number, value)
        return number

    def scales(self, value: float) -> bool:
        """Whether a spread is a factor on a number, as where it cannot be negative; else it is an amount."""
        return self.minimum is not None and self.minimum >= 0 and value > 0

    def _read_spread(self, spread: SpreadText, text: str) -> Uncertain:
        number = self.read(spread.value, units_required=True)
        if self.fixed:
            words = "what follows from it is worked out when a file is read, so it has no spread. Leave it out"
            raise ValueError(f'"{shorten(text)}": {words}.')
        if spread.plus_minus.endswith("%"):
            plus_minus = abs(number) * parse_quantity(spread.plus_minus.removesuffix("%"), "number") / 100
        else:
            plus_minus = parse_quantity(spread.plus_minus, self.dimension)
        if not plus_minus > 0:
            raise ValueError(f'"{shorten(text)}" has no spread: what follows +- must be more than 0.')
        found = Uncertain(number, plus_minus, spread.each)
        low = -math.inf if self.minimum is None or self.scales(number) else self.minimum
        high = math.inf if self.maximum is None else self.maximum
        if not low <= number - plus_minus <= number + plus_minus <= high:
            raise ValueError(f'"{shorten(text)}" is out of range: with its spread it must be {self.allowed()}.')
        return found

    def _check_range(self, number: float, value: Any) -> None:
        low = self.minimum is not None and (number < self.minimum or (self.exclusive and number == self.minimum))
        if low or (self.maximum is not None and number > self.maximum):
            shown = value if isinstance(value, str) else format_quantity(number, self.dimension)
            raise ValueError(f'"{shorten(shown)}" is out of range: it must be {self.allowed()}.')

    def allowed(self) -> str:
        """Return the range in words: `more than 0 m`, `from 0 to 0.5`, `more than 0 and at most 1`."""
        low = None if self.minimum is None else format_quantity(self.minimum, self.dimension)
        high = None if self.maximum is None else format_quantity(self.maximum, self.dimension)
        if low is not None and high is not None:
            return f"more than {low} and at most {high}" if self.exclusive else f"from {low} to {high}"
        if high is not None:
            return f"at most {high}"
        return f"{'more than' if self.exclusive else 'at least'} {low}"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        def validate(value: Any, info: ValidationInfo) -> float:
            try:
                return self.read(value, units_required=isinstance(info.context, QuantitySource))
            except ValueError as error:
                raise PydanticCustomError("quantity", "{why}", {"why": str(error)}) from None

        return core_schema.with_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        kind = DIMENSIONS[self.dimension]
        if not kind.unit:
            limits = {"exclusiveMinimum" if self.exclusive else "minimum": self.minimum, "maximum": self.maximum}
            plain = {"type": "number", **{k: v for k, v in limits.items() if v is not None}}
            return plain if self.fixed else {"anyOf": [plain, {"type": "string", "pattern": _WITH_SPREAD}]}
        examples = [text.strip('"') for text in kind.example.split(" or ")]
        text = {"type": "string", "pattern": _WITH_UNIT, "errorMessage": expected(self.dimension)}
        return {"anyOf": [text, {"const": 0}], "examples": examples}


@dataclass(frozen=True)
class QuantityOrGroup(Quantity):
    """Marks `float | Model`: a quantity, or a group of fields of which it follows."""

    group: type[BaseModel] = BaseModel

    def tag(self, value: Any) -> str:
        """Return the name of the model, or `quantity`."""
        return self.group.__name__ if isinstance(value, dict | BaseModel) else "quantity"

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        alone = super().__get_pydantic_core_schema__(source, handler)
        choices = {"quantity": alone, self.group.__name__: handler.generate_schema(self.group)}
        return core_schema.tagged_union_schema(choices, discriminator=self.tag)

    def __get_pydantic_json_schema__(self, schema: Any, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        alone = super().__get_pydantic_json_schema__(schema, handler)
        return alone | {"anyOf": [*alone["anyOf"], handler(schema["choices"][self.group.__name__])]}


def spread_text(value: float, dimension: str) -> str:
    """Return ` +- 0.1 MPa`, with `each` where it is of each; empty for a number without a spread."""
    if not isinstance(value, Uncertain):
        return ""
    return f" +- {format_quantity(value.plus_minus, dimension)}{' each' * value.each}"


def given(value: Any) -> str:
    """Return a value that does not fit, for a message."""
    if isinstance(value, dict):
        return "a group of fields"
    if isinstance(value, list | tuple):
        return "a list"
    return "an empty value" if value is None else f'"{shorten(value)}"'

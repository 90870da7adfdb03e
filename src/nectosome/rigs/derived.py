"""Quantities whose units are made of others, as those of rates and of what a sensor gives for a volt."""

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import GetCoreSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from nectosome.io.errors import shorten
from nectosome.io.units import read_any, unit_to_si


@dataclass(frozen=True)
class Derived:
    """Marks a float as a quantity of an SI `unit`, which a file gives in any multiple of it."""

    name: str
    unit: str
    example: str

    def expected(self) -> str:
        """What should have been written."""
        return f'{self.name.capitalize()} expected, as in "{self.example}".'

    def read(self, value: Any) -> float:
        """The SI number of text; ValueError says what is wrong."""
        try:
            number, unit = read_any(str(value))
        except ValueError as error:
            raise ValueError(f"{error} {self.expected()}") from None
        if not unit:
            raise ValueError(f'"{shorten(value)}" has no unit. {self.expected()}')
        if unit != unit_to_si(self.unit)[1]:
            raise ValueError(f'"{shorten(value)}" is no {self.name}. {self.expected()}')
        return number

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> core_schema.CoreSchema:
        def validate(value: Any) -> float:
            try:
                return self.read(value)
            except ValueError as error:
                raise PydanticCustomError("quantity", "{why}", {"why": str(error)}) from None

        return core_schema.no_info_plain_validator_function(validate)


PressureRate = Annotated[float, Derived("pressure rate", "Pa/s", "3.8 bar/s")]
PressurePerVolt = Annotated[float, Derived("pressure per volt", "Pa/V", "0.2 bar/V")]
LengthPerVolt = Annotated[float, Derived("length per volt", "m/V", "8 mm/V")]
AngularAcceleration = Annotated[float, Derived("angular acceleration", "rad/s2", "20 rad/s2")]

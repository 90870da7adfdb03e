"""Quantities of any unit, written before it is known which channel they belong to."""

from typing import Annotated, Any

from pydantic import PlainValidator, WithJsonSchema

from nectosome.io.schema.described import unfit
from nectosome.units import read_any, scale_to_si, shorten, split_unit, unit_to_si


def _text(value: Any) -> str:
    """The text of a quantity. A number without unit may be 0, or one of a channel that has no unit."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        raise unfit(f'"{shorten(value)}" is no quantity. A number with a unit expected, as in "20 deg" or "0.6 bar".')
    try:
        read_any(str(value))
    except ValueError as error:
        raise unfit(str(error)) from None
    return str(value)


AnyQuantity = Annotated[
    str, PlainValidator(_text), WithJsonSchema({"type": ["string", "number"], "examples": ["20 deg", "0.6 bar"]})
]
"""Text of a quantity of any unit."""


def same_unit(text: str, unit: str, *, difference: bool = False) -> float:
    """SI value of a quantity of a channel whose SI unit is `unit`; of a `difference` of two, temperatures are in K.

    Raises ValueError, a sentence for people, for another unit.
    """
    needed = unit_to_si(unit)[1]
    value, given = read_any(text)
    if value == 0 and not given:
        return 0.0
    if given != needed:
        what = f"is in {given}" if given else "has no unit"
        raise ValueError(f'"{shorten(text)}" {what}, and {needed or "a number without unit"} is needed.')
    if difference and scale_to_si(split_unit(text)[1])[1]:
        raise ValueError(f'"{shorten(text)}" is a temperature and not a difference of two. Write it in K.')
    return value


def unit_size(text: str) -> float | None:
    """Size in SI of the unit in which a quantity is written; None where it has none."""
    unit = split_unit(text)[1]
    return scale_to_si(unit)[0] if unit else None

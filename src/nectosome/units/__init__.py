"""Quantities at the boundary: text with a unit to SI and back, ranges, and the errors that a user sees."""

from .conversion import (
    expected,
    format_quantity,
    parse_quantity,
    read_any,
    read_positive,
    read_quantity,
    show_quantity,
    shown_unit,
    unit_to_si,
)
from .dimensions import DIMENSIONS, Dimension, dimension_of
from .errors import InputError, count, did_you_mean, shorten

__all__ = [
    "DIMENSIONS",
    "Dimension",
    "InputError",
    "count",
    "did_you_mean",
    "dimension_of",
    "expected",
    "format_quantity",
    "parse_quantity",
    "read_any",
    "read_positive",
    "read_quantity",
    "shorten",
    "show_quantity",
    "shown_unit",
    "unit_to_si",
]

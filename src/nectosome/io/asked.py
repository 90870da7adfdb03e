"""Quantities that are asked for in a line of text: read, or told what is wrong with them."""

from .errors import InputError
from .units import parse_quantity


def read_quantity(text: str, dimension: str, field: str) -> float:
    """Return the SI value. Raises InputError, which names the field."""
    try:
        return parse_quantity(text, dimension)
    except ValueError as error:
        raise InputError(str(error), field=field) from None


def read_positive(text: str, dimension: str, field: str) -> float:
    """Return the SI value, more than 0. Raises InputError, which names the field."""
    value = read_quantity(text, dimension, field)
    if value <= 0:
        raise InputError(f'"{text}" is out of range: it must be more than 0.', field=field)
    return value

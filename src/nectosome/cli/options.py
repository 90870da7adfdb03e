"""Options that are quantities and counts: read from text, or told what is wrong with them."""

import re

from nectosome.io import InputError, parse_quantity


def read_quantity(text: str, dimension: str, option: str) -> float:
    """Return the SI value of an option. Raises InputError."""
    try:
        return parse_quantity(text, dimension)
    except ValueError as error:
        raise InputError(str(error), field=option) from None


def read_duration(text: str, option: str) -> float:
    """Return a time [s] of more than 0 s. Raises InputError."""
    seconds = read_quantity(text, "time", option)
    if seconds <= 0:
        raise InputError(f'"{text}" is out of range: it must be more than 0 s.', field=option)
    return seconds


def read_count(text: str, option: str, *, least: int, most: int) -> int:
    """Return a whole number from `least` to `most`. Raises InputError."""
    number = int(text) if re.fullmatch(r"-?\d{1,9}", text) else least - 1
    if not least <= number <= most:
        raise InputError(f'"{text}" must be a whole number from {least} to {most}.', field=option)
    return number

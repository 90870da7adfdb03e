"""Options that are counts: read from text, or told what is wrong with them."""

import re

from nectosome.io import InputError


def read_count(text: str, option: str, *, least: int, most: int) -> int:
    """Return a whole number from `least` to `most`. Raises InputError."""
    number = int(text) if re.fullmatch(r"-?\d{1,9}", text) else least - 1
    if not least <= number <= most:
        raise InputError(f'"{text}" must be a whole number from {least} to {most}.', field=option)
    return number

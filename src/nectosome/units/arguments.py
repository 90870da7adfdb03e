"""What a public function was given: the wrong kind of thing is answered with a sentence that names the argument."""

from collections.abc import Collection, Iterable, Mapping
from numbers import Integral
from typing import TYPE_CHECKING, Any

from .errors import InputError, kind_of, shorten

if TYPE_CHECKING:
    import numpy as np


def check_names(given: Any, field: str, example: str) -> None:
    """Raise InputError unless `given` is a mapping."""
    if not isinstance(given, Mapping):
        raise InputError(
            f"{kind_of(given)} is given where names with values are expected, as in {example}.", field=field
        )


def check_choice(given: Any, known: Collection[str], field: str) -> None:
    """Raise InputError unless `given` is one of the names."""
    if not isinstance(given, str) or given not in known:
        raise InputError(f'"{shorten(given)}" is none of {", ".join(known)}.', field=field)


def check_whole(given: Any, field: str, least: int) -> None:
    """Raise InputError unless `given` is a whole number of at least `least`."""
    if not isinstance(given, Integral) or isinstance(given, bool) or given < least:
        raise InputError(f'"{shorten(given)}" must be a whole number of at least {least}.', field=field)


def check_share(given: Any, field: str) -> None:
    """Raise InputError unless `given` is a number between 0 and 1."""
    try:
        within = 0 < float(given) < 1
    except (TypeError, ValueError):
        within = False
    if not within:
        raise InputError(f'"{shorten(given)}" is out of range: it must be more than 0 and less than 1.', field=field)


def read_numbers(given: Any, field: str) -> "np.ndarray":
    """Numbers as an array. Raises InputError."""
    import numpy as np

    try:
        return np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{kind_of(given)} is given where numbers are expected.", field=field) from None


def read_pairs(texts: Iterable[str] | None, field: str, example: str) -> dict[str, str]:
    """Read `NAME=VALUE` texts, each name once. Raises InputError, which shows the example."""
    pairs: dict[str, str] = {}
    for text in texts or ():
        name, equals, value = (part.strip() for part in text.partition("="))
        if not (name and equals and value):
            raise InputError(f'"{shorten(text)}" must have a name, = and a value, as in "{example}".', field=field)
        if name in pairs:
            raise InputError(f"{shorten(name)} is named twice.", field=field)
        pairs[name] = value
    return pairs

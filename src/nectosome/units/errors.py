"""Messages for users: input errors with the position, the value and the remedy; statuses with their reason."""

import re
from collections.abc import Collection, Iterable, Mapping
from difflib import get_close_matches
from enum import IntEnum
from numbers import Integral
from typing import TYPE_CHECKING, Any, Self

if TYPE_CHECKING:
    import numpy as np


class InputError(Exception):
    """A mistake in the user's input: a file, a setting, a path. The command line exits with code 2.

    `file` (name), `line` (from 1) and `field` (dotted path), as far as known, precede the message:
    `robot.yaml, line 14, limbs.filament.young: "7.4 MP" has no unit called MP.`
    """

    def __init__(self, message: str, *, file: str | None = None, line: int | None = None, field: str | None = None):
        self.message, self.file, self.line, self.field = message, file, line, field
        where = [file or "", f"line {line}" if line is not None else "", field or ""]
        prefix = ", ".join(part for part in where if part)
        super().__init__(f"{prefix}: {message}" if prefix else message)


def did_you_mean(name: str, known: Iterable[str], most: int = 12) -> str:
    """Return ` Did you mean "..."?` for the nearest `known` name, else the list of names, if at most `most`."""
    names = list(known)
    near = get_close_matches(name, names, n=1, cutoff=0.6)
    if near:
        return f' Did you mean "{near[0]}"?'
    if 0 < len(names) <= most:
        return f" Known: {', '.join(names)}."
    return ""


_WORD, _MESSAGE = 300, 1000  # characters


def printable(text: str) -> str:
    """Return text with a blank for each character that a terminal would obey instead of show it, but for line ends."""
    return "".join(c if c.isprintable() or c == "\n" else " " for c in text)


def cut_words(line: str) -> str:
    """Return a line with what is too long of a word for a terminal left out within it."""
    return re.sub(rf"\S{{{_WORD + 1},}}", lambda found: f"{found[0][:200]}...{found[0][-50:]}", line)


def brief(message: str) -> str:
    """Return a message as one line of a thousand characters at most; names that are too long are cut within."""
    line = " ".join(cut_words(printable(message)).split())
    return line if len(line) <= _MESSAGE else f"{line[:750]}...{line[-240:]}"


def shorten(value: object, limit: int = 60) -> str:
    """Return `value` as one line of at most `limit` characters, for messages."""
    if isinstance(value, dict):
        text = "{" + ", ".join(map(str, value)) + "}"
    elif value is None:
        text = "null"
    elif isinstance(value, bool):
        text = str(value).lower()
    else:
        text = str(value)
    text = printable(text).replace("\n", " ")
    return text if len(text) <= limit else text[: limit - 3] + "..."


def count(n: int, thing: str) -> str:
    """Return `1 part`, `2 parts`."""
    return f"{n} {thing}{'' if n == 1 else 's'}"


_KINDS = {
    "Dataset": "a dataset",
    "DataArray": "a data array",
    "DataFrame": "a table",
    "ndarray": "an array of numbers",
    "ArrayImpl": "an array of numbers",
    "Run": "a run",
    "SimulationRun": "a run",
    "Steady": "a steady motion",
    "Periodic": "a periodic motion",
    "Static": "a static equilibrium",
}


def kind_of(thing: Any) -> str:
    """Return what something is, for messages: its kind, and a number itself."""
    kind = type(thing)
    if thing is None:
        return "nothing (None)"
    if isinstance(thing, str):
        return f'the text "{shorten(thing)}"'
    if kind.__name__ in _KINDS:
        return _KINDS[kind.__name__]
    if isinstance(thing, bool | int | float | bytes):
        return f"the {kind.__name__} {shorten(thing)}"
    return f"{'an' if kind.__name__[0].lower() in 'aeiou' else 'a'} {kind.__name__}"


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


class ReasonedStatus(IntEnum):
    """A status, which is its value as an integer; a member is defined by its value and its `reason`."""

    reason: str

    def __new__(cls, value: int, reason: str) -> Self:
        """A member of its value and its reason."""
        member = int.__new__(cls, value)
        member._value_, member.reason = value, reason
        return member

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"<{type(self).__name__}.{self.name}: {self.reason}>"

"""Names of quantities, conditions and clocks that a sheet may not give."""

from collections.abc import Iterable

_COORDINATES = ("row", "repeat")
_SYMBOL = 2  # letters of a name up to which capitals count: F is a force, and f a frequency


def collision(columns: Iterable[str], conditions: Iterable[str], clocks: Iterable[str]) -> tuple[str, str] | None:
    """Return the field with the first name of a sheet that is not allowed, and why; None where all are.

    Names may not be those of coordinates, hold slashes, or differ from another one by capitals and blanks only.
    """
    groups = ("columns", columns), ("conditions", conditions)
    given = [(f"{group}.{name}", name) for group, names in groups for name in names]
    for field, name in given:
        if _plain(name).casefold() == "time":
            why = "the time has a field of its own, as in time: {column: time, unit: s}. Take it out of this group."
            return field, why
        if _plain(name).casefold() in _COORDINATES:
            return field, "has the name of a coordinate that recordings have. Give another."
        if not name.strip() or "/" in name:
            return field, "must be a name without slashes."
    for group in (given, [(f"clocks.{name}", name) for name in clocks]):
        seen: dict[str, tuple[str, str]] = {}
        for field, name in group:
            key = _plain(name) if len(_plain(name)) <= _SYMBOL else _plain(name).casefold()
            other, known = seen.setdefault(key, (field, name))
            if other != field:
                how = "has the name of" if name == known else "differs only by capitals or blanks from"
                return field, f"{how} {other}. Give another."
    return None


def _plain(name: str) -> str:
    return " ".join(name.split())

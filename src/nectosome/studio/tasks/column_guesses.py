"""What the columns of a recording are, as far as names and units tell: what drove the robot, what is compared."""

from collections.abc import Iterable, Mapping

# what a bench calls a reading, and what it calls a signal
_CALLED = {
    "fx": "force.x",
    "fy": "force.y",
    "fz": "force.z",
    "force": "force.x",
    "load": "force.x",
    "thrust": "force.x",
}
_DRIVES = ("command", "drive", "input", "set", "servo", "angle", "pressure", "torque", "tension", "speed")


def guessed(
    columns: Mapping[str, str], signals: Mapping[str, str], readings: Mapping[str, str]
) -> tuple[dict[str, str], dict[str, str]]:
    """Columns that are compared, with their readings, and those that drive, with the paths of signals.

    All three are units [SI] by name. A pair has one unit, but where the file has none. A name that is that of a signal
    or a reading, or its last part, counts before a word that benches use; a word before nothing. A signal is driven by
    one column.
    """
    driven, compared = dict[str, str](), dict[str, str]()
    for column, unit in columns.items():
        fits = [path for path, of in signals.items() if unit in ("", of) and path not in driven.values()]
        named = next((path for path in fits if path.rpartition(".")[2] == column), None)
        if named is None and len(fits) == 1 and unit and _has_word(column, _DRIVES):
            named = fits[0]
        if named is not None:
            driven[column] = named
            continue
        known = [name for name, of in readings.items() if unit in ("", of)]
        exact = (name for name in known if column in (name, name.rpartition(".")[2]))
        called = (name for word, name in _CALLED.items() if _has_word(column, (word,)))
        found = next(exact, None) or next((name for name in called if name in known and unit), None)
        if found is not None:
            compared[column] = found
    return compared, driven


def _has_word(column: str, words: Iterable[str]) -> bool:
    """Whether a column's name has one of these words, by itself or at an end: `load_cell`, `servo angle`, `Fx`."""
    parts = "".join(x if x.isalnum() else " " for x in column.lower()).split()
    return any(part == word or part.startswith(word) for part in parts for word in words)

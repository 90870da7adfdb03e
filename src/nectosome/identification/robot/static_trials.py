"""Recordings whose rows are shapes at rest: what was set in each row, and what was read."""

import json
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.description import RobotDescription, apply_settings, numeric_paths, resolve
from nectosome.io.schema.quantity import Si
from nectosome.io.schema.structure import at_path
from nectosome.units import InputError, count, did_you_mean

from ..recordings import column_of, conditions_of, unit_of

if TYPE_CHECKING:
    import xarray as xr

_MOST = 2000  # rows of a recording


class SetRows(NamedTuple):
    """Numbers of a robot that were set by hand, row by row."""

    paths: tuple[str, ...]
    values: Float[np.ndarray, "n s"]  # [SI]


def is_at_rest(recording: "xr.Dataset", file: str) -> bool:
    """Whether each row of a recording is a shape at rest: it has no time, or a single row, which is no motion.

    Raises InputError for several rows without a time of which nobody says so, and for too many of them.
    """
    if "row" not in recording.dims:
        return recording.sizes.get("time") == 1
    rows, provenance = recording.sizes["row"], json.loads(recording.attrs.get("provenance", "{}"))
    sheet = provenance.get("settings", {}).get("sheet", {"time": None})
    if rows > 1 and "time" not in sheet:
        how = "or its rate; or write time: none there, where each row is a shape at rest."
        raise InputError(f"has no time. Say in the campaign which column it is, {how}", file=file)
    if rows > _MOST:
        what = f"has {rows} rows, each a shape at rest; {_MOST} are the most. Leave some out, or take their means."
        raise InputError(what, file=file)
    return True


def set_rows(
    recording: "xr.Dataset", file: str, description: RobotDescription, inputs: Mapping[str, str]
) -> tuple[RobotDescription, SetRows]:
    """What was set in each row: conditions of the recording, and `inputs`, columns and the paths that they set.

    A path is that of a number, or of a signal: then the returned robot has a constant in its place. Raises InputError
    that names file and column for a value that is missing, in another unit or not allowed, a path that is neither, and
    one that is set twice.
    """
    rows = next(iter(recording.sizes.values()))
    given = {str(name): (np.full(rows, float(x)), unit_of(x)) for name, x in conditions_of(recording).items()}
    paths = {name: name for name in given}
    for column, path in inputs.items():
        given[column], paths[column] = column_of(recording, column, file), path
    found = dict[str, Float[np.ndarray, "n"]]()
    for name, path in paths.items():
        try:
            description, numbers = _set(description, path, *given[name])
        except InputError as error:
            raise InputError(error.message, file=file, field=name) from None
        double = next((one for one in numbers if one in found), None)
        if double is not None:
            raise InputError(f"{double} is set twice.", file=file, field=name)
        found |= numbers
    values = np.stack([*found.values()], axis=1) if found else np.zeros((rows, 0))
    return description, SetRows(tuple(found), values)


def _set(
    description: RobotDescription, path: str, values: Float[np.ndarray, "n"], unit: str
) -> tuple[RobotDescription, dict[str, Float[np.ndarray, "n"]]]:
    """The robot with the first of these values at a path, and all of them for each number that the path stands for."""
    missing = np.flatnonzero(~np.isfinite(values))
    if missing.size:
        raise InputError(f"is missing in row {missing[0] + 1}. Leave the row out, or fill it in.")
    known = numeric_paths(description)
    if path not in known and path not in description.aliases:
        slot, _ = at_path(description, path)
        if slot is None or "constant" not in slot.kinds():
            near = did_you_mean(path, [*description.aliases, *known])
            raise InputError(
                f'"{path}" is no number and no signal of {description.name}, so that nothing sets it.{near}'
            )
        description = apply_settings(description, {path: {"kind": "constant", "value": Si(values[0], unit)}})
        path, known = f"{path}.value", numeric_paths(description)
    names = resolve(description, path)
    for k, value in enumerate(values.tolist(), start=1):
        try:
            for name in names:
                known[name].read(Si(value, unit), units_required=True)
        except ValueError as error:
            raise InputError(f"row {k}: {error}") from None
    return apply_settings(description, {path: Si(values[0], unit)}), dict.fromkeys(names, values)


def read_rows(
    recording: "xr.Dataset", file: str, columns: Sequence[tuple[str, str, str]]
) -> tuple[Float[np.ndarray, "k n"], tuple[str, ...]]:
    """What was read in each row of columns (name, reading, its SI unit), NaN where it is missing, and notes.

    Raises InputError for a column that is missing, empty or in another unit.
    """
    out = []
    for column, reading, expected in columns:
        values, given = column_of(recording, column, file)
        check_unit(given, column, reading, expected, file)
        if not np.isfinite(values).any():
            raise InputError("has no values: nothing can be identified from it.", file=file, field=column)
        out.append(values)
    gaps = int(np.sum(~np.isfinite(out)))
    notes = [f"{count(gaps, 'value')} of shapes at rest missing: not compared"] if gaps else []
    return np.where(np.isfinite(out), out, np.nan), tuple(notes)


def check_unit(given: str, column: str, reading: str, expected: str, file: str) -> None:
    """Raise InputError for a column that is not in the SI unit of what it measures."""
    if given != expected:
        how = "Give its unit in the campaign, or compare it with something else."
        what = f"is in {given or 'no unit'}, and {reading} in {expected or 'no unit'}. {how}"
        raise InputError(what, file=file, field=column)

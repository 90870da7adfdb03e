"""Tables in files about rods: columns of places along them, with their units."""

import math
from itertools import pairwise
from pathlib import Path
from typing import Any

from nectosome.description.meshes import path_in
from nectosome.io.schema.described import Shorthand, wrong
from nectosome.io.schema.quantity import Quantity, Si
from nectosome.units import DIMENSIONS, InputError

_MOST = 200  # rows
_NEAR = 1e-6  # of the length, or of a value: these are the same
_SECTION = ("radius", "width", "height", "young", "density", "damping", "wall")
_COLUMNS = "x or at, and any of " + ", ".join(_SECTION)


class SectionTable(Shorthand):
    """Marks rows of sections that may stand in a file of their own, whose name is written instead."""

    def expand(self, value: Any) -> Any:
        """Leave the rows, which were read with the rod."""
        return value

    def shorten(self, row: list[Any]) -> Any:
        """Leave the rows: the file is not needed any more."""
        return row

    def json_schema(self, row: dict[str, Any]) -> dict[str, Any]:
        """Return the schema of a name."""
        return {"type": "string"}


Column = tuple[str, list[float]]  # unit, values [SI]


def read_columns(folder: Path, name: str, field: str) -> dict[str, Column]:
    """Return the columns of a table in SI units. Raises the error of a field for what is no such table."""
    import numpy as np

    from nectosome.measure import read  # it takes a second, and few robots need it

    try:
        table = read(path_in(folder, name))
    except InputError as error:
        raise wrong(field, str(error)) from None
    rows = next(iter(table.sizes.values()))
    if not 2 <= rows <= _MOST:
        raise wrong(field, f"{name} has {rows} rows; a rod takes 2 to {_MOST}.")
    found = {}
    for label, column in table.data_vars.items():
        values = column.values.astype(float)
        if bad := np.flatnonzero(~np.isfinite(values)).tolist():
            raise wrong(field, f"{name}, column {label}: there is no number in row {bad[0] + 1}.")
        unit = str(column.attrs.get("units", ""))
        found[str(label)] = "" if unit == "1" else unit, values.tolist()
    return found


def places(columns: dict[str, Column], length: float, name: str, field: str) -> list[float]:
    """Return the fractions of the length of the rows of a table, increasing. Raises the error of a field."""
    if ("at" in columns) == ("x" in columns):
        raise wrong(field, f"{name} needs a column x, as in x (mm), or a column at, the fraction of the length.")
    unit, values = columns.get("at") or columns["x"]
    if "x" in columns:
        if unit != "m":
            raise wrong(field, f"{name} gives x no unit of length. Write it into its heading, as in x (mm).")
        values = [x / length for x in values]
    elif unit:
        raise wrong(field, f"{name} gives at a unit, and it is a fraction of the length from 0 to 1. Call it x.")
    values = [float(round(x)) if abs(x - round(x)) < _NEAR else x for x in values]
    for k, (before, after) in enumerate(pairwise(values), start=2):
        if not before < after:
            raise wrong(field, f"{name}, row {k}: places must increase along the rod.")
    if values[0] < 0 or values[-1] > 1:
        row, at = (1, values[0]) if values[0] < 0 else (len(values), values[-1])
        raise wrong(field, f"{name}, row {row}: is at {at:.4g} of the length, outside of the rod, which is 0 to 1.")
    return values


def read_sections(rod: dict[str, Any], folder: Path) -> dict[str, Any]:
    """Return the fields of a rod with the sections of a table in a file instead of its name.

    A row at the tip becomes the fields of the tip; one at the root has to be what the rod's own fields say. Raises the
    error of a field.
    """
    name = rod["between"]
    columns = read_columns(folder, name, "between")
    if unknown := [column for column in columns if column not in ("x", "at", *_SECTION)]:
        raise wrong("between", f'{name} has a column "{unknown[0]}", which no section has. It may have {_COLUMNS}.')
    known = [column for column in columns if column in _SECTION]
    if not known:
        raise wrong("between", f"{name} says nothing of the sections. It may have {_COLUMNS}.")
    try:
        length = Quantity("length").read(rod.get("length"), units_required=False)
    except ValueError:
        return {**rod, "between": []}  # the length is the mistake, which is told
    at = places(columns, length, name, "between")
    rows = [{column: Si(columns[column][1][k], columns[column][0]) for column in known} for k in range(len(at))]
    out = {**rod, "between": [{"at": x, **row} for x, row in zip(at, rows, strict=True) if 0 < x < 1]}
    for which, x, row in (("first", at[0], rows[0]), ("last", at[-1], rows[-1])):
        for column, value in row.items() if x in (0, 1) else ():
            own = column if x == 0 else f"tip_{column}"
            if own not in rod and x == 1:
                out[own] = value
            elif not _same(rod.get(own), value):
                why = "differs from" if own in rod else "is missing, but stands in"
                raise wrong(own, f"{why} the {which} row of {name}. Write the same in both, or drop that row.")
    return out


def _same(written: Any, value: Si) -> bool:
    """Whether a quantity as it is written is a number; one that cannot be read has an error of its own."""
    dimension = next((name for name, kind in DIMENSIONS.items() if kind.unit == value.unit), "number")
    try:
        own = Quantity(dimension).read(written, units_required=False)
    except ValueError:
        return False
    return math.isclose(own, value, rel_tol=_NEAR)

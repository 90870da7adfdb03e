"""Shapes of rods free of stress: from a drawn centre line, or from a table of curvatures, to strains at rest."""

import math
from pathlib import Path

from nectosome.description.rod_fields import STRAINS_AT_REST, RestStrains
from nectosome.description.rod_tables import Column, places, read_columns
from nectosome.io.schema.described import wrong
from nectosome.units import DIMENSIONS, InputError, format_quantity, show_quantity

_ANGULAR = ("torsion", "bending_y", "bending_z")


def fitted_rest(rest: RestStrains, length: float, folder: Path) -> RestStrains:
    """Return strains at rest without the line or the file that they have: with what follows from it.

    Raises the error of a field.
    """
    for name in STRAINS_AT_REST:
        if getattr(rest, name):
            why = f"the {'line' if rest.line else 'file'} has the shape. Leave one of the two out"
            raise wrong(name, f"{why}.")
    if rest.file is None:
        rows = [(*point, 0.0)[:3] for point in rest.line]
        return _of_line(rows, "line", length, rest.order)
    if rest.line:
        raise wrong("line", "the file has the shape. Leave one of the two out.")
    columns = read_columns(folder, rest.file, "file")
    if columns.keys() & {*STRAINS_AT_REST}:
        return _of_table(columns, rest.file, length, rest.order)
    if not {"x", "y"} <= columns.keys() <= {"x", "y", "z"}:
        why = f"{rest.file} is no shape of a rod: it has columns {', '.join(columns)}"
        raise wrong("file", f"{why}. A line has x, y and z; a table has x or at, and strains such as bending_z.")
    if bare := [name for name, (unit, _) in columns.items() if unit != "m"]:
        raise wrong("file", f"{rest.file} gives {bare[0]} no unit of length. Write it into its heading, as in x (mm).")
    flat = "", [0.0] * len(columns["x"][1])
    rows = [*zip(*(columns.get(name, flat)[1] for name in "xyz"), strict=True)]
    return _of_line(rows, "file", length, rest.order)


def _of_line(rows: list[tuple[float, ...]], field: str, length: float, order: int | None) -> RestStrains:
    import numpy as np

    from nectosome.geometry.centre_lines import fit_line

    try:
        found = fit_line(np.array(rows), float(length), order)
    except InputError as error:
        raise wrong(field, error.message) from None
    orders = len(found.bending_y or found.bending_z) - 1
    off, turned = show_quantity(found.distance, "length"), math.degrees(found.turned)
    told = f"its line of {len(rows)} points by polynomials of order {orders}, {off} off at most"
    told += f"; turned by {turned:.3g} deg to begin along x" if turned > 0.05 else ""
    return RestStrains(bending_y=found.bending_y, bending_z=found.bending_z).with_note(told)


def _of_table(columns: dict[str, Column], name: str, length: float, order: int | None) -> RestStrains:
    import numpy as np

    from nectosome.geometry.centre_lines import fit_curvature

    if unknown := [column for column in columns if column not in ("x", "at", *STRAINS_AT_REST)]:
        known = ", ".join(STRAINS_AT_REST)
        raise wrong(
            "file", f'{name} has a column "{unknown[0]}", which is no strain. It may have x or at, and {known}.'
        )
    at, rows, told = np.array(places(columns, length, name, "file")), {}, []
    for strain in [column for column in columns if column in STRAINS_AT_REST]:
        unit, values = columns[strain]
        angular = strain in _ANGULAR
        if unit not in (("m-1", "1/m", "rad/m", "rad m-1") if angular else ("",)):
            wanted = DIMENSIONS["curvature"].unit if angular else "none"
            raise wrong("file", f'{name} gives {strain} the unit "{unit}", and it is {wanted}.')
        try:
            rows[strain], off = fit_curvature(at, np.array(values), order)
        except InputError as error:
            raise wrong("file", f"{name}, column {strain}: {error.message}") from None
        most = max(map(abs, values))
        size = format_quantity(float(f"{most:.3g}"), "curvature" if angular else "number")
        told.append(f"{strain} up to {size} by a polynomial of order {len(rows[strain]) - 1}, {100 * off:.2g} % off")
    return RestStrains(**rows).with_note(f"its table of {len(at)} rows: {'; '.join(told)}")

"""A saved run as a table over time, each column with one unit in its heading."""

import re
from typing import TYPE_CHECKING

from nectosome.io.results import table_of
from nectosome.mechanism import SLIDES

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr

_EITHER = re.compile(r"(?P<name>.+) \((?P<turns>[^()]+) or (?P<slides>[^()]+)\)")
_WITHOUT_LENGTH = re.compile(r"\.(extension|shear_y|shear_z)\.\d+$")


def run_table(dataset: "xr.Dataset") -> "pd.DataFrame":
    """Table of a run as `nectosome.io.results.table_of` makes it, in SI units.

    Where a quantity of coordinates has a unit by kind, as in rad or m, each column has that of its coordinate.
    """
    return table_of(dataset).rename(columns=_with_one_unit)


def column_groups(table: "pd.DataFrame") -> dict[tuple[str, ...], list[str]]:
    """Headings of a table by all words of each but the last: (`velocity`, `body`) has `velocity body x (m/s)`."""
    groups: dict[tuple[str, ...], list[str]] = {}
    for heading in table.columns:
        words = tuple(heading.partition(" (")[0].split(" "))
        groups.setdefault(words[:-1] or words, []).append(heading)
    return groups


def _with_one_unit(heading: str) -> str:
    match = _EITHER.fullmatch(heading)
    if match is None:
        return heading
    name, unit = match["name"], match["turns"]
    if name.rpartition(".")[2] in SLIDES:
        unit = match["slides"]
    elif _WITHOUT_LENGTH.search(name):  # its coordinate is a strain
        unit = unit.replace("rad", "1")
    return name if unit == "1" else f"{name} ({unit})"

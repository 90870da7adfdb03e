"""What a killed experiment leaves: its journal, read as far as it goes."""

import json
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.io.atomic import reason
from nectosome.units import InputError

from .log import COLUMNS, dataset

if TYPE_CHECKING:
    import xarray

_ATTRIBUTE = re.compile(r"# (\w+): (.*)")


def recovered(journal: str | Path) -> "xarray.Dataset":
    """Return what a journal holds; `status_reason` says where it breaks off, and what was left out.

    Lines after the first that is torn or damaged are left out. Raises InputError for a file that cannot be read or is
    no journal of a run.
    """
    try:
        text = Path(journal).read_bytes().decode(errors="replace")
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}.", file=str(journal)) from None
    attributes: dict[str, Any] = {}
    units: dict[str, str] = {}
    rows: list[list[float]] = []
    lines = text.splitlines(keepends=True)
    sound = 0
    for line in lines:
        if not (line.endswith("\n") and _take(line[:-1], attributes, units, rows)):
            break
        sound += 1
    if not units:
        raise InputError("this is no journal of a run, or its head is damaged.", file=str(journal))
    if "status" not in attributes:
        until = f" at {rows[-1][0]:.3f} s" if rows else " before the first sample"
        lost = f"; {len(lines) - sound} torn or damaged lines were left out" if sound < len(lines) else ""
        why = f"the process was killed, or the power failed: the journal breaks off{until}{lost}."
        attributes |= {"status": "killed", "status_reason": why}
    return dataset(np.array(rows).reshape(-1, len(COLUMNS)), attributes, units)


def _take(line: str, attributes: dict[str, Any], units: dict[str, str], rows: list[list[float]]) -> bool:
    """Take in a line; say whether it is sound."""
    try:
        if found := _ATTRIBUTE.fullmatch(line):
            attributes[found[1]] = json.loads(found[2])
        elif not units:
            head = dict(re.findall(r"(\w+) \[([^]]*)\]", line))
            if tuple(head) != COLUMNS:
                return False
            units |= head
        else:
            row = [float(x) for x in line.split(",")]
            if len(row) != len(COLUMNS):
                return False
            rows.append(row)
    except ValueError:
        return False
    return True

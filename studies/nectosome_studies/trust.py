"""How far to trust it: by kind of robot and quantity, the errors met so far on what others measured."""

from collections.abc import Sequence
from statistics import median
from typing import NamedTuple

from nectosome.view.scorecard import Row

from . import STUDIES
from .study import fits


class Met(NamedTuple):
    """Errors [percent] of one quantity of one kind of robot, all of them counted."""

    robot: str
    quantity: str
    rows: int
    typical: float  # median of their sizes
    lowest: float
    highest: float
    note: str


def met(rows: Sequence[Row]) -> list[Met]:
    """Groups of all studies whose rows are given. Raises RuntimeError where a row is in no group, or in several.

    All predictions of measured numbers are counted, the bad ones too; none can be left out.
    """
    groups = [group for entry in STUDIES.values() for group in entry.trust]
    taken: dict[int, list[Row]] = {}
    for row in rows:
        if row["kind"] != "prediction" or row["source"] != "measured" or row["error"] is None:
            continue
        of = [k for k, group in enumerate(groups) if fits(group["rows"], row["id"])]
        if len(of) != 1:
            raise RuntimeError(f"scorecard row {row['id']} is in {len(of)} groups of trust in a study.toml")
        taken.setdefault(of[0], []).append(row)
    return [_met(groups[k], taken[k]) for k in sorted(taken)]


def _met(group: dict[str, str], rows: Sequence[Row]) -> Met:
    errors = [row["error"] for row in rows]
    typical = median(map(abs, errors))
    note = group.get("note", "")
    return Met(group["robot"], group["quantity"], len(rows), typical, min(errors), max(errors), note)

"""How far to trust it: by kind of robot and quantity, the errors met so far on what others measured."""

import tomllib
from collections.abc import Sequence
from fnmatch import fnmatchcase
from importlib.resources import files
from statistics import median
from typing import NamedTuple

from nectosome.view.scorecard import Row


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
    """Groups of `trust.toml` whose rows are given. Raises RuntimeError where a row is in no group, or in several.

    All predictions of measured numbers are counted, the bad ones too; none can be left out.
    """
    text = files("nectosome.papers").joinpath("trust.toml").read_text(encoding="utf-8")
    groups = tomllib.loads(text)["groups"]
    taken: dict[str, list[Row]] = {}
    for row in rows:
        if row["kind"] != "prediction" or row["source"] != "measured" or row["error"] is None:
            continue
        of = [k for k, group in enumerate(groups) if any(fnmatchcase(row["id"], place) for place in group["rows"])]
        if len(of) != 1:
            raise RuntimeError(f"scorecard row {row['id']} is in {len(of)} groups of trust.toml")
        taken.setdefault(str(of[0]), []).append(row)
    return [_met(groups[int(k)], taken[k]) for k in sorted(taken, key=int)]


def _met(group: dict[str, str], rows: Sequence[Row]) -> Met:
    errors = [row["error"] for row in rows]
    typical = median(map(abs, errors))
    note = group.get("note", "")
    return Met(group["robot"], group["quantity"], len(rows), typical, min(errors), max(errors), note)

"""The table of the flow about a robot's loads: Reynolds, Keulegan-Carpenter number, reduced frequency; and warnings."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from nectosome.description import parse_robot
from nectosome.io.tables import Label, Number, Table
from nectosome.units import InputError

from ..flow_ranges import flow_rows, out_of_range

_HEADS = {"reynolds": "Re", "keulegan_carpenter": "KC", "reduced_frequency": "k", "stalled": "beyond stall"}
_MEANING = "Re: Reynolds number; KC: Keulegan-Carpenter number; k: reduced frequency"


def regime(arrays: Mapping[str, np.ndarray], attributes: Mapping[str, Any]) -> tuple[list[Table], list[str], list[str]]:
    """Return a table of the numbers of loads on parts, what they mean, and a warning for each load beyond its ranges.

    `arrays` are those of results, with mean powers and forces (`loads_of_water`). Nothing of a robot that is not known,
    and of a run that has no such numbers.
    """
    try:
        description = parse_robot(str(attributes["robot"]))
    except (InputError, KeyError):  # of another program, or of an older version
        return [], [], []
    if "flow_number" not in arrays:
        return [], [], []
    rows = list[tuple[Label | Number | str, ...]]()
    for row in flow_rows(arrays, description):
        label = Label(f"{row.name} on {row.where}", f"{row.name.replace('_', ' ')} on {row.where}")
        first, *others = (_number(row.numbers[key]) for key in _HEADS)
        rows.append((label, first, row.length, *others))
    heads = {"of": "regime", "reynolds": _HEADS["reynolds"], "length": "of its", **_HEADS}
    unknown = {
        key
        for k, key in enumerate(heads)
        if not any(isinstance(x := row[k], Number) and x.value == x.value for row in rows)
    }
    table = Table("regime", heads, rows, hidden=unknown - {"of", "length"})
    return [table], [_MEANING] if rows else [], out_of_range(arrays, description)


def _number(value: float) -> Number:
    return Number(value, shown="infinite" if math.isinf(value) else "")

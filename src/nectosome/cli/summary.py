"""A run in a few lines: where the body came, what the joints need, where the power goes, and whether it balances."""

import json
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.page import acting, columns, ending, is_joint, number, page, powers, reaction_unit, servos

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np

    Arrays = Mapping[str, np.ndarray]


def summary(arrays: "Arrays", attributes: "Mapping[str, Any]", loads: bool = False) -> Group:
    """Return body, joints, powers, energies and status; with `loads`, each load on each part as well.

    `mean` is over a cycle, or the last tenth of another run.
    """
    import numpy as np

    time = np.asarray(arrays["time"], dtype=float)
    cycle = "period" in attributes and time.size > 1
    kept = time < time[-1] if cycle else time >= time[-1] - 0.1 * (time[-1] - time[0])

    def mean(name: str) -> "np.ndarray":
        return arrays[name][kept].mean(axis=0)

    length = f", {time[-1]:.4g} s" if time.size > 1 else ""
    title = Text(f"{attributes['title']}{length}", "bold")
    tables = [_body(arrays, mean("velocity")[0])]
    if any(map(is_joint, arrays["prescribed"])):
        tables.append(_joints(arrays, mean("reaction")))
    tables += [acting(arrays, mean("load_force"), mean("load_power"))] if loads else []
    tables += [
        powers(arrays, mean("load_power").sum(axis=1), mean("reaction_power")),
        _energies(arrays, mean("energy")),
    ]
    balance = float(np.max(arrays["power_balance"]))
    return page(title, tables, [f"power balance: off by {balance:.1e} at worst", *_asked(arrays), ending(attributes)])


def _asked(arrays: "Arrays") -> list[str]:
    """What was asked of servos whose limits are known."""
    import numpy as np

    if "reaction_limit" not in arrays:
        return []
    return servos(arrays, *(np.abs(arrays[name]).max(axis=0) for name in ("reaction", "drive_velocity")))


def origin(attributes: "Mapping[str, Any]") -> Table:
    """Return where a run comes from: the settings it was made with, versions and time."""
    known: dict[str, Any] = json.loads(attributes["provenance"])
    table = columns("made with", "")
    for key, value in known.items():
        shown = ", ".join(f"{k} {_plain(v)}" for k, v in value.items()) if isinstance(value, dict) else _plain(value)
        table.add_row(key, shown)
    return table


def _plain(value: Any) -> str:
    return f"({', '.join(map(str, value))})" if isinstance(value, list) else str(value)


def _body(arrays: "Arrays", mean: "np.ndarray") -> Table:
    import numpy as np

    velocity, position = (arrays[name][-1, 0] for name in ("velocity", "position"))
    table = columns(str(arrays["part"][0]), "x", "y", "z", "size", "unit")
    rows = (("velocity at the end", velocity, "m/s"), ("mean velocity", mean, "m/s"), ("position", position, "m"))
    for name, vector, unit in rows:
        size = number(float(np.linalg.norm(vector))) if unit == "m/s" else ""
        table.add_row(name, *(number(x) for x in vector), size, unit)
    return table


def _joints(arrays: "Arrays", reaction: "np.ndarray") -> Table:
    table = columns("driven joint", "mean reaction", "unit")
    for name, force in zip(arrays["prescribed"], reaction, strict=True):
        if is_joint(str(name)):
            table.add_row(str(name), number(force), reaction_unit(str(name)))
    return table


def _energies(arrays: "Arrays", energies: "np.ndarray") -> Table:
    table = columns("energy", "mean", "unit")
    for name, joules in zip(arrays["form"], energies, strict=True):
        table.add_row(str(name), number(joules), "J")
    return table

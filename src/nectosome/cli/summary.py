"""A run in a few lines: where the body came, what the joints need, where the power goes, and whether it balances."""

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.cli.page import acting, columns, ending, is_joint, number, page, powers, reaction_unit, servos
from nectosome.io import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import xarray as xr

    Arrays = Mapping[str, np.ndarray]

_NEEDED = {
    "position": ("time", "station", "axis"),
    "velocity": ("time", "part", "axis"),
    "load_force": ("time", "load", "part", "axis"),
    "load_power": ("time", "load", "part"),
    "reaction": ("time", "prescribed"),
    "reaction_power": ("time", "prescribed"),
    "energy": ("time", "form"),
    "power_balance": ("time",),
}
_HDF5 = b"\x89HDF"
_ATTRIBUTES = ("title", "robot", "status", "status_reason", "provenance")


def is_run(what: str) -> bool:
    """Return whether that is a results file, by its name or by how it begins, and no robot."""
    if what.endswith(".nc"):
        return True
    try:
        with Path(what).open("rb") as file:
            return file.read(4) == _HDF5
    except (OSError, ValueError):
        return False


def check_run(dataset: "xr.Dataset", source: str) -> None:
    """Raise InputError where a results file is not that of a simulation; `source` names it."""
    for name, dims in _NEEDED.items():
        if name not in dataset or dataset[name].dims != dims or dataset[name].dtype.kind != "f":
            raise InputError(f"this is not a simulation: it has no {name} over {', '.join(dims)}.", file=source)
    for name in ("time", "part", "load", "prescribed", "form"):
        if name not in dataset.coords:
            raise InputError(f"this is not a simulation: its {name} has no names or values.", file=source)
    if not dataset.sizes["time"] or not dataset.sizes["part"]:
        raise InputError("this simulation is empty.", file=source)
    for name in _ATTRIBUTES:
        if not isinstance(dataset.attrs.get(name), str):
            raise InputError(f"this is not a simulation: its {name} is missing.", file=source)
    try:
        known = isinstance(json.loads(dataset.attrs["provenance"]), dict)
    except ValueError:
        known = False
    if not known:
        raise InputError("this is not a simulation: its provenance cannot be read.", file=source)


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

"""A run in a few lines: where the body came, what the joints need, where the power goes, and whether it balances."""

import json
from typing import TYPE_CHECKING, Any

from rich.console import Group
from rich.table import Table
from rich.text import Text

from nectosome.io import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    import xarray as xr

    Arrays = Mapping[str, np.ndarray]

_NEEDED = {
    "position": ("time", "station", "axis"),
    "velocity": ("time", "part", "axis"),
    "load_power": ("time", "load", "part"),
    "reaction": ("time", "prescribed"),
    "reaction_power": ("time", "prescribed"),
    "energy": ("time", "form"),
    "power_balance": ("time",),
}
_ATTRIBUTES = ("title", "robot", "status", "status_reason", "provenance")


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


def summary(arrays: "Arrays", attributes: "Mapping[str, Any]") -> Group:
    """Return body, joints, powers, energies and status; `mean` is over the last tenth of the run."""
    import numpy as np

    time = np.asarray(arrays["time"], dtype=float)
    tenth = time >= time[-1] - 0.1 * (time[-1] - time[0])

    def mean(name: str) -> "np.ndarray":
        return arrays[name][tenth].mean(axis=0)

    length = f", {time[-1]:.4g} s" if time.size > 1 else ""
    title = Text(f"{attributes['title']}{length}", "bold")
    tables = [_body(arrays, mean("velocity")[0])]
    if arrays["prescribed"].size:
        tables.append(_joints(arrays, mean("reaction")))
    tables += [
        _powers(arrays, mean("load_power").sum(axis=1), mean("reaction_power")),
        _energies(arrays, mean("energy")),
    ]
    balance = float(np.max(arrays["power_balance"]))
    end = Text(
        f"power balance: off by {balance:.1e} at worst\n"
        f"status: {attributes['status']}, {attributes['status_reason']}{_effort(attributes)}"
    )
    spaced = [thing for table in tables for thing in (table, Text())]
    return Group(title, Text(), *spaced, end)


def _effort(attributes: "Mapping[str, Any]") -> str:
    """What it took, as far as it was noted."""
    told = []
    if "steps" in attributes:
        told.append(f"{attributes['steps']} steps, {attributes.get('rejected', '?')} rejected")
    if "growth" in attributes:
        told.append(f"slowest disturbance grows at {attributes['growth']:.3g} 1/s")
    if "jacobians" in attributes and "residuals" in attributes:
        told.append(f"{attributes['residuals']} residuals, {attributes['jacobians']} Jacobians")
    if "seconds" in attributes:
        told.append(f"{attributes['seconds']:.1f} s to compute")
    return "".join(f"; {part}" if i == 0 else f", {part}" for i, part in enumerate(told))


def origin(attributes: "Mapping[str, Any]") -> Table:
    """Return where a run comes from: the settings it was made with, versions and time."""
    known: dict[str, Any] = json.loads(attributes["provenance"])
    table = _table("made with", "")
    for key, value in known.items():
        shown = ", ".join(f"{k} {_plain(v)}" for k, v in value.items()) if isinstance(value, dict) else _plain(value)
        table.add_row(key, shown)
    return table


def _plain(value: Any) -> str:
    return f"({', '.join(map(str, value))})" if isinstance(value, list) else str(value)


def _table(*columns: str) -> Table:
    table = Table(box=None, pad_edge=False, header_style="bold", title_justify="left")
    for i, name in enumerate(columns):
        table.add_column(name, justify="right" if i and name not in ("", "unit") else "left", no_wrap=bool(name))
    return table


def _body(arrays: "Arrays", mean: "np.ndarray") -> Table:
    import numpy as np

    velocity, position = (arrays[name][-1, 0] for name in ("velocity", "position"))
    table = _table(str(arrays["part"][0]), "x", "y", "z", "size", "unit")
    rows = (("velocity at the end", velocity, "m/s"), ("mean velocity", mean, "m/s"), ("position", position, "m"))
    for name, vector, unit in rows:
        size = _number(float(np.linalg.norm(vector))) if unit == "m/s" else ""
        table.add_row(name, *(_number(x) for x in vector), size, unit)
    return table


def _joints(arrays: "Arrays", reaction: "np.ndarray") -> Table:
    table = _table("driven joint", "mean reaction", "unit")
    for name, force in zip(arrays["prescribed"], reaction, strict=True):
        table.add_row(str(name), _number(force), "N m" if str(name).endswith(".angle") else "N")
    return table


def _powers(arrays: "Arrays", loads: "np.ndarray", joints: "np.ndarray") -> Table:
    table = _table("power into the robot", "mean", "unit")
    named = [*zip(arrays["prescribed"], joints, strict=True), *zip(arrays["load"], loads, strict=True)]
    for name, watts in named:
        if watts != 0:
            table.add_row(str(name).replace("_", " "), _number(watts), "W")
    table.add_row("sum", _number(loads.sum() + joints.sum()), "W")
    return table


def _energies(arrays: "Arrays", energies: "np.ndarray") -> Table:
    table = _table("energy", "mean", "unit")
    for name, joules in zip(arrays["form"], energies, strict=True):
        table.add_row(str(name), _number(joules), "J")
    return table


def _number(value: float) -> str:
    return f"{value:.4g}"

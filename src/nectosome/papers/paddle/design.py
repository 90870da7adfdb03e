"""Strokes and hinges of the paddle with three joints between the points of the grids, by exact slopes of its cycle."""

from dataclasses import replace
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import get_value, with_values
from nectosome.description.variables import Box, read_variable
from nectosome.designs import Limit, MotionDesign
from nectosome.robots import describe
from nectosome.search import Gradient, minimise

from .thrust import servo_speed, with_hinges

RANGES = {
    "A": "30 deg .. 75 deg",
    "f": "0.3 Hz .. 1.3 Hz",
    "thickness": "2 mm .. 8 mm",
    "length": "30 mm .. 150 mm",
}
COSTS = ("power", "stress")
_ROOM = 1.002  # of a cost: what the grid tells of it to 1e-3 keeps its own limit
_LOOSE = {"drive_rate": 100.0, "power": 1e3, "stress": 1e9}  # limits that nothing comes near to


def best_strokes() -> xr.Dataset:
    """Most thrust of strokes that the servo can follow without load: with the hinges as they are, and chosen."""
    start, limits = {"A": np.radians(50), "f": 1.1}, {"drive_rate": servo_speed()}
    rows = {
        "stroke": best(start, ("A", "f"), limits),
        "stroke and hinges": best(start, tuple(RANGES), limits),
    }
    return _table(rows, "chosen")


def front(hinges: xr.Dataset, cost: str, count: int = 6) -> xr.Dataset:
    """Most thrust of hinges for as much of a cost, at 75 deg and 1.1 Hz; searches start on the front of a grid."""
    members = hinges.stack(design=("thickness", "length"))
    members = members.isel(design=np.flatnonzero(members[f"front_{cost}"])).sortby(cost)
    rows = {}
    for k in np.unique(np.linspace(0, members.sizes["design"] - 1, count).round().astype(int)).tolist():
        member = members.isel(design=k)
        start = {name: float(member[name]) for name in ("thickness", "length")} | {"A": np.radians(75), "f": 1.1}
        rows[k] = best(start, ("thickness", "length"), {cost: _ROOM * float(member[cost])})
    return _table(rows, "level")


def best(start: dict[str, float], free: tuple[str, ...], limits: dict[str, float]) -> dict[str, float]:
    """Most thrust within upper limits on quantities [SI], from a start [SI], where only `free` variables change.

    Variables and quantities of the best paddle [SI]. All calls ask for one program, whatever is free. Raises
    RuntimeError where no design keeps the limits.
    """
    robot = with_hinges(describe("paddle"))
    at = {name: start.get(name, get_value(robot, name)) for name in RANGES}
    variables = [read_variable(name, text, robot) for name, text in RANGES.items()]
    u = Box(tuple(variables)).design(with_values(robot, at)).clip(0, 1)
    variables = [v if v.name in free else replace(v, lower=at[v.name], upper=at[v.name]) for v in variables]
    upper = tuple(Limit(name, True, value) for name, value in (_LOOSE | limits).items())
    task = MotionDesign(robot, tuple(variables), "thrust", upper, "-y")
    found = minimise(task, Gradient(tolerance=1e-5, evaluations=60), u).best
    if found is None:
        raise RuntimeError(f"no paddle keeps {', '.join(task.constraint_names)} from {at} on")
    return dict(zip(RANGES, task.box.values(found.u).tolist(), strict=True)) | dict(found.outputs)


def _table(rows: dict[Any, dict[str, float]], dim: str) -> xr.Dataset:
    """Variables and quantities of designs [SI] along one dimension."""
    names = ("thrust", "power", "stress", "drive_rate", *RANGES)
    return xr.Dataset({name: (dim, [row[name] for row in rows.values()]) for name in names}, {dim: list(rows)})

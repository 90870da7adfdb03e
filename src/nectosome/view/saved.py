"""Whether a results file is a saved run, and one that can be drawn, or a saved sweep."""

import json
from contextlib import suppress

import numpy as np
import xarray as xr

from nectosome.core import Status
from nectosome.designs.sweep import MEANS
from nectosome.solve.motor_results import MOTOR_VARIABLES
from nectosome.solve.results import TENDON_VARIABLES
from nectosome.units import InputError

_NEEDED = {
    "position": ("time", "station", "axis"),
    "rotation": ("time", "station", "row", "axis"),
    "station_x": ("station",),
    "half_width": ("station", "across"),
    "velocity": ("time", "part", "axis"),
    "load_force": ("time", "load", "part", "axis"),
    "load_power": ("time", "load", "part"),
    "reaction": ("time", "prescribed"),
    "reaction_power": ("time", "prescribed"),
    "energy": ("time", "form"),
    "power_balance": ("time",),
}
_NAMED = ("time", "part", "load", "prescribed", "form", "axis", "station_part")
# those that a run has with motors, tendons or limits, of which older versions saved fewer
_FILLED = {name: ("time", *dims) for name, (dims, _) in (MOTOR_VARIABLES | TENDON_VARIABLES).items()}
_FILLED |= {"drive_velocity": ("time", "prescribed"), "drive_velocity_limit": ("prescribed",)}
_FARTHEST = 1e9  # m, s: what is drawn beside it would be lost in its digits
_SHEARED = 1e-3  # of the determinant of a rotation, against 1
_ATTRIBUTES = ("title", "robot", "status", "status_reason", "provenance")


def saved_run(dataset: xr.Dataset, source: str) -> xr.Dataset:
    """Return a results file as a run: NaN where it lacks arrays of motors, tendons or limits.

    Raises InputError where it is not that of a simulation; `source` names it.
    """

    def need(fits: bool, what: str) -> None:
        if not fits:
            raise InputError(f"this is not a simulation: {what}.", file=source)

    for name, dims in _NEEDED.items():
        fits = name in dataset and dataset[name].dims == dims and dataset[name].dtype.kind == "f"
        need(fits, f"it has no {name} over {', '.join(dims)}")
    for name in (*_NAMED, *({"motor", "battery", "tendon"} & {*map(str, dataset.dims)})):
        need(name in dataset.coords, f"its {name} has no names or values")
    if not dataset.sizes["time"] or not dataset.sizes["part"]:
        raise InputError("this simulation is empty.", file=source)
    for name in _ATTRIBUTES:
        need(isinstance(dataset.attrs.get(name), str), f"its {name} is missing")
    known = False
    with suppress(ValueError):
        known = isinstance(json.loads(dataset.attrs["provenance"]), dict)
    need(known, "its provenance cannot be read")
    there = {*map(str, dataset.dims)} if "reaction_limit" in dataset else {*map(str, dataset.dims)} - {"prescribed"}
    lacking = {name: dims for name, dims in _FILLED.items() if name not in dataset and {*dims} <= there}
    return dataset.assign(
        {name: (dims, np.full([dataset.sizes[d] for d in dims], np.nan)) for name, dims in lacking.items()}
    )


def check_drawable(run: xr.Dataset, source: str) -> None:
    """Raise InputError where a saved run does not tell at all times where its stations are, and how they are turned."""
    for name in ("position", "rotation", "half_width", "station_x", "time"):
        if not np.isfinite(run[name].values).all():
            raise InputError(f"its {name} is not finite everywhere: it cannot be drawn.", file=source)
        if run[name].size and np.abs(run[name].values).max() > _FARTHEST:
            raise InputError(f"its {name} is beyond {_FARTHEST:g}: it cannot be drawn.", file=source)
    turned = run["rotation"].values
    if np.abs(np.linalg.det(turned) - 1).max(initial=0.0) > _SHEARED:
        raise InputError("its rotation turns nothing, its determinant is not 1: it cannot be drawn.", file=source)
    if not np.all(np.diff(run["time"].values) > 0):
        raise InputError("its times do not go on: it cannot be drawn.", file=source)


def check_sweep(dataset: xr.Dataset, source: str) -> None:
    """Raise InputError where a results file is not a sweep of one robot over one or two quantities."""

    def need(fits: bool, what: str) -> None:
        if not fits:
            raise InputError(f"this is not a sweep of a robot that can be shown: {what}.", file=source)

    need("status" in dataset, "it has no status")
    status = dataset["status"]
    need(status.ndim in (1, 2) and status.size > 0, "it is not over one or two quantities")
    need(all(str(word) in Status.__members__ for word in status.values.ravel()), "its status is not known here")
    for name in status.dims:
        values = dataset[name]
        fits = name in dataset.coords and values.dtype.kind == "f" and bool(np.isfinite(values.values).all())
        need(fits and isinstance(values.attrs.get("units"), str), f"its {name} has no values with a unit")
    for name in MEANS:
        fits = name in dataset and dataset[name].dtype.kind == "f" and set(dataset[name].dims) == set(status.dims)
        need(fits and isinstance(dataset[name].attrs.get("units"), str), f"it has no {name} with a unit")
    for name in ("force", "force_peak"):
        fits = name in dataset and set(dataset[name].dims) == {*status.dims, "axis"} and "axis" in dataset.coords
        need(fits and isinstance(dataset[name].attrs.get("units"), str), f"it has no {name} over axis with a unit")
    need(bool(dataset.attrs.get("robot")) and isinstance(dataset.attrs["robot"], str), "its robot is missing")

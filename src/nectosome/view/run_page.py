"""The page of one run: the robot in motion, motors and tendons, track, velocity, forces, powers and energies."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from nectosome.description import RobotDescription
from nectosome.description.ranges import NUMBERS
from nectosome.io.results import dataset_of
from nectosome.solve import Run, flow_rows, out_of_range
from nectosome.solve.mean_window import mean_of
from nectosome.units import InputError

from . import series
from .closed_loop import closed_loop_panels
from .markup import plain
from .motor_panels import motor_panels
from .page import write_page
from .scenes import picture_interval, run_scene
from .still import html_table
from .style import Panel
from .tubes import description

_BLURRED = 0.2  # revolutions of a drive between two pictures, from which on it looks slower than it is


def show_run(run: Run | xr.Dataset, path: str | Path) -> None:
    """Write a page about any one run, with its robot in motion, track, velocity, forces, powers and energies.

    Of one under a controller also how the reference was followed. The page works offline and is written whole or not at
    all. Raises InputError for what is no run, and where the page cannot be written.
    """
    run = dataset_of(run)
    if "position" not in run or "time" not in run.dims:
        raise InputError("this dataset is no run: it lacks the positions of the robot over time.")
    title = str(run.attrs.get("title") or "simulation")
    source = json.loads(run.attrs.get("provenance") or "{}")
    robot = description(run)
    parts: list[str | Panel] = [] if robot is None else [f"<p>{plain(robot.about)}</p>"]
    small = " · ".join(filter(None, [run.attrs.get("status_reason"), origin(source)]))
    parts.append(f'<p class="small">{plain(small)}</p>')
    loop = closed_loop_panels(run) if "reference" in run else []
    driven = [*motor_panels(run), *series.tension_panels(run)]
    way = [*series.track_panels(run), series.velocity_panel(run), *series.force_panels(run)]
    numbers = [*way, series.power_panel(run), series.energy_panel(run)]
    write_page(path, title, [*parts, *_scene_panel(run), *loop, *driven, *numbers, *regime_parts(run, robot)])


def _scene_panel(run: xr.Dataset) -> list[Panel]:
    """The robot in motion, at the times at which its places are known; none where there are none."""
    known = [
        np.isfinite(run[name].values).reshape(run.sizes["time"], -1).all(axis=1) for name in ("position", "rotation")
    ]
    run = run.isel(time=known[0] & known[1])
    if not run.sizes["time"]:
        return []
    caption = "Simulated motion in its own time; the camera goes along. Drag to turn, scroll to come nearer."
    turns = series.drive_rate(run) * picture_interval(run["time"].values) / (2 * np.pi)
    if turns > _BLURRED:
        caption += f" Pictures are {turns:.2g} revolutions of the drive apart: the turning looks slower than it is."
    return [Panel("The robot in motion", caption, run_scene(run))]


def origin(source: Mapping[str, Any]) -> str:
    """Version, time, machine and packages in a line."""
    if not source:
        return ""
    packages = source.get("packages", {})
    words = [
        f"nectosome {source.get('nectosome', '')}",
        str(source.get("time", "")),
        f"Python {source.get('python', '')}",
        f"JAX {packages['jax']}" if "jax" in packages else "",
        str(source.get("platform", "")),
        f"{source['processors']} processors" if source.get("processors") else "",
    ]
    return " · ".join(word for word in words if word)


_COLUMNS = {key: words for key, words in NUMBERS.items() if key != "aspect_ratio"}  # not of the flow


def regime_parts(run: xr.Dataset, robot: RobotDescription | None) -> list[str]:
    """The table and a sentence for each load whose model is left; nothing of runs without such numbers."""
    if robot is None or "flow_number" not in run:
        return []
    arrays = {name: run[name].values for name in ("load", "part", "flow_number")}
    arrays |= {name: mean_of(run, run.attrs, name) for name in ("load_power", "load_force")}
    rows = flow_rows(arrays, robot)
    if not rows:
        return []
    known = [key for key in _COLUMNS if any(row.numbers[key] == row.numbers[key] for row in rows)]
    heads = ("regime", "length", *(_COLUMNS[key] for key in known))
    cells = [(f"{row.name} on {row.where}", row.length, *(_shown(row.numbers[key]) for key in known)) for row in rows]
    warned = [f"<p>Warning: {plain(words)}.</p>" for words in out_of_range(arrays, robot)]
    return [html_table([heads, *cells]), *warned]


def _shown(value: float) -> str:
    return "" if np.isnan(value) else "infinite" if np.isinf(value) else f"{value:.4g}"

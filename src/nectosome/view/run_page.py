"""The page of one run: the robot in motion, motors and tendons, track, velocity, forces, powers and energies."""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.core.described import number
from nectosome.description import RobotDescription, robot_of_run
from nectosome.description.ranges import NUMBERS
from nectosome.drives import GearedMotor
from nectosome.io.results import dataset_of
from nectosome.solve import Run, flow_rows, out_of_range
from nectosome.solve.mean_window import mean_of
from nectosome.units import InputError

from . import series
from .closed_loop import closed_loop_panels
from .markup import plain
from .page import write_page
from .scenes import picture_interval, run_scene
from .still import html_table
from .style import CYCLE, Panel, dress
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
    write_page(path, title, [*parts, *_scene_panel(run, robot), *loop, *driven, *numbers, *regime_parts(run, robot)])


def _scene_panel(run: xr.Dataset, robot: RobotDescription | None) -> list[Panel]:
    """The robot in motion, at the times at which its places are known; none where there are none."""
    known = [
        np.isfinite(run[name].values).reshape(run.sizes["time"], -1).all(axis=1) for name in ("position", "rotation")
    ]
    run = run.isel(time=known[0] & known[1])
    if not run.sizes["time"]:
        return []
    caption = "Simulated motion in its own time; the camera goes along. Drag to turn, scroll to come nearer."
    if robot is not None and robot.water.streams:
        caption += " The arrow is the velocity of the water at the body, drawn above it."
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


def motor_panels(run: xr.Dataset) -> list[Panel]:
    """Panels of the motors; none of a run without."""
    if "motor" not in run.dims or "time" not in run.dims:
        return []
    return [_angles(run), _torques(run), _powers(run)]


def _angles(run: xr.Dataset) -> Panel:
    """Joints over time, and the references of servos, dashed; slides in mm."""
    names = [str(name) for name in run["motor"].values]
    kinds = [unit for unit in ("deg", "mm") if any(_unit(name) == unit for name in names)]
    fig = make_subplots(len(kinds), 1, shared_xaxes=True, vertical_spacing=0.08)
    for i, name in enumerate(names):
        factor, place = _factor(name), {"row": 1 + kinds.index(_unit(name)), "col": 1}
        colour = CYCLE[i % len(CYCLE)]
        position, reference = (factor * run[f"motor_{key}"].values[:, i] for key in ("position", "reference"))
        fig.add_scatter(x=run["time"].values, y=position, name=name, line={"color": colour}, **place)
        if np.isfinite(reference).all():
            dashed = {"color": colour, "dash": "dash"}
            fig.add_scatter(x=run["time"].values, y=reference, name=f"{name}, reference", line=dashed, **place)
    for row, unit in enumerate(kinds, start=1):
        fig.update_yaxes(title=f"{'angle' if unit == 'deg' else 'displacement'} ({unit})", row=row, col=1)
    fig.update_xaxes(title="time (s)", row=len(kinds), col=1)
    dress(fig, 320 * len(kinds)).update_layout(showlegend=True)
    return Panel("Joints and references", "Simulated joints that motors move; dashed: the references of servos.", fig)


def _torques(run: xr.Dataset) -> Panel:
    """Torque against speed, and the line of each motor at the voltage of its supply."""
    fig = go.Figure()
    for i, name in enumerate(map(str, run["motor"].values)):
        colour = CYCLE[i % len(CYCLE)]
        moving = run["motor_rate"].values[:, i], run["motor_torque"].values[:, i]
        fig.add_scatter(x=moving[0], y=moving[1], name=name, mode="lines", line={"color": colour})
        line = _line(robot_of_run(str(run.attrs["robot"])), name)
        if line is not None:
            speed, torque = line
            for sign in (1, -1):
                dots = {"color": colour, "dash": "dot"}
                label = f"{name}, torque line"
                fig.add_scatter(
                    x=sign * speed, y=sign * torque, name=label, mode="lines", line=dots, showlegend=sign > 0
                )
    slides = [_unit(str(name)) == "mm" for name in run["motor"].values]
    units = ("force (N)", "speed (m/s)") if all(slides) else ("torque (N m)", "speed (rad/s)")
    fig.update_yaxes(title=units[0])
    fig.update_xaxes(title=units[1])
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest")
    caption = (
        "Simulated torque of each motor at its joint against the speed of the joint. Dotted: what the motor gives at "
        "the voltage of its supply without sag. Where speed and torque have different signs it brakes."
    )
    return Panel("Torque against speed", caption, fig)


def _powers(run: xr.Dataset) -> Panel:
    """Currents, electrical powers and heat over time, and the power of batteries."""
    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.08)
    time = run["time"].values
    for i, name in enumerate(map(str, run["motor"].values)):
        colour = CYCLE[i % len(CYCLE)]
        fig.add_scatter(x=time, y=run["current"].values[:, i], name=name, line={"color": colour}, row=1, col=1)
        for key, dash, words in (("electrical_power", "solid", "electrical"), ("motor_heat", "dot", "heat")):
            line = {"color": colour, "dash": dash}
            fig.add_scatter(x=time, y=run[key].values[:, i], name=f"{name}, {words}", line=line, row=2, col=1)
    for i, name in enumerate(map(str, run["battery"].values) if "battery" in run.dims else []):
        line = {"color": CYCLE[(run.sizes["motor"] + i) % len(CYCLE)], "dash": "dash"}
        fig.add_scatter(x=time, y=run["battery_power"].values[:, i], name=f"battery {name}", line=line, row=2, col=1)
    fig.update_yaxes(title="current (A)", row=1, col=1)
    fig.update_yaxes(title="power (W)", row=2, col=1)
    fig.update_xaxes(title="time (s)", row=2, col=1)
    dress(fig, 520).update_layout(showlegend=True)
    caption = "Simulated currents, electrical powers and heat of motors; that of a battery has its electronics in it."
    return Panel("Currents and electrical powers", caption, fig)


def _unit(name: str) -> str:
    return "deg" if name.endswith(".angle") else "mm"


def _factor(name: str) -> float:
    return 180 / np.pi if _unit(name) == "deg" else 1e3


def _line(robot: RobotDescription, name: str) -> tuple[np.ndarray, np.ndarray] | None:
    """Speeds and torques of a motor from rest to its no-load speed; None where its voltage has no end."""
    drive = robot.powered[name].drive
    voltage = robot.supply_voltage(drive)
    if voltage is None:
        return None
    speed, torque = GearedMotor.of(drive).torque_line(number(voltage))
    return np.asarray(speed), np.asarray(torque)

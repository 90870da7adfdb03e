"""The motors of a run: joints and their references, torque against speed beside the motor's line, currents."""

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.core.described import number
from nectosome.description import RobotDescription, parse_robot
from nectosome.drives import GearedMotor

from .style import CYCLE, Panel, dress


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
        line = _line(parse_robot(str(run.attrs["robot"])), name)
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

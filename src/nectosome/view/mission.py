"""Figures of a mission: height, speed, place, pitch, and a ribbon of its modes.

Data as `solve.mission_data` gives it.
"""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREEN, GREY, ORANGE, PURPLE, SKY, VERMILLION, Panel, dress, plain, readable

_RIBBON = (SKY, ORANGE, GREY, GREEN, PURPLE, VERMILLION)
_ASIDE = 1e-3  # m, to the side, from which on a robot does not stay in a plane
_SMOOTH = 1.0  # s, of the mean speed
_ARROWS = 2.0  # s, from one to the next
_SHOWN = {"m3": ("mL", 1e6)}  # units that axes have instead, and how many of them one is


def show_mission(found: xr.Dataset, path: str | Path) -> None:
    """Write a page about one mission, whole or not at all. Raises InputError where it cannot be written."""
    title = str(found.attrs["title"])
    shown = [mission_panel(found), *([set_panel(found)] if found.sizes["quantity"] else [])]
    if np.ptp(found["position"].sel(axis="y").values) > _ASIDE:
        shown.append(above_panel(found))
    write_page(path, title, [f"<p>{plain(str(found.attrs['status_reason']))}</p>", *shown])


def mission_panel(found: xr.Dataset) -> Panel:
    """Height, velocity along the tank, place and pitch over time, with the modes."""
    time = found["time"].values
    x, z = (found["position"].sel(axis=axis).values for axis in "xz")
    rows = (
        ("height", "height z (m)", z),
        ("velocity", "velocity along x (m/s)", found["velocity"].sel(axis="x").values),
        ("place", "place x along the tank (m)", x),
        ("pitch", "pitch (deg)", np.degrees(found["pitch"].values)),
    )
    fig = make_subplots(len(rows), 1, shared_xaxes=True, vertical_spacing=0.035)
    for row, (name, title, values) in enumerate(rows, start=1):
        line = {"color": BLUE, "width": 1 if name == "velocity" else 1.8}
        fig.add_scatter(x=time, y=values, name=name, mode="lines", line=line, row=row, col=1)
        fig.update_yaxes(title={"text": title.replace(" (", "<br>("), "font": {"size": 12}}, row=row, col=1)
    ends = [np.searchsorted(time, t).clip(0, time.size - 1) for t in (time - 0.5 * _SMOOTH, time + 0.5 * _SMOOTH)]
    went = x[ends[1]] - x[ends[0]]
    mean = went / np.maximum(time[ends[1]] - time[ends[0]], 1e-9)
    fig.add_scatter(x=time, y=mean, name=f"mean of {_SMOOTH:g} s", line={"color": VERMILLION}, row=2, col=1)
    fig.update_xaxes(title="time (s)", row=len(rows), col=1)
    dress(fig, 760).update_layout(margin_t=64, margin_l=96)
    _ribbon(fig, found)
    passed = zip(*(found[name].values for name in ("event_mode", "event", "event_time")), strict=True)
    events = ", ".join(f"{mode} until {event} at {t:.2f} s" for mode, event, t in passed)
    caption = (
        f"Simulated, with a schedule that is synthetic: {events}. Velocity as it is, and in red the mean over "
        f"{_SMOOTH:g} s; it is negative towards -x."
    )
    return Panel("Course of a mission", caption, fig)


def above_panel(found: xr.Dataset) -> Panel:
    """Path over the floor, mode by mode, and where the robot's x axis points now and then."""
    fig = go.Figure()
    x, y = (found["position"].sel(axis=axis).values for axis in "xy")
    heading = found["heading"].values
    names = found["mode"].values
    for k, mode in enumerate(dict.fromkeys(names)):
        here = names == mode
        line = {"color": CYCLE[k % len(CYCLE)], "width": 2}
        fig.add_scatter(x=x[here], y=y[here], mode="lines", line=line, name=readable(plain(mode)))
    every = np.searchsorted(found["time"].values, np.arange(0.0, found["time"].values[-1], _ARROWS))
    marker = {"symbol": "arrow", "angle": 90 - np.degrees(heading[every]), "size": 12, "color": BLACK}
    fig.add_scatter(x=x[every], y=y[every], mode="markers", marker=marker, name=f"heading, every {_ARROWS:g} s")
    fig.update_xaxes(title="x (m)", constrain="domain")
    fig.update_yaxes(title="y (m)", scaleanchor="x")
    dress(fig, 320).update_layout(showlegend=True, margin_t=60)
    return Panel("Seen from above", "Way of the body's centre, to scale; arrows point along its x axis.", fig)


def set_panel(found: xr.Dataset) -> Panel:
    """What the modes set, over time."""
    values = found["quantity_value"].values
    groups: dict[tuple[str, bytes], list[str]] = {}
    for k, path in enumerate(found["quantity"].values):
        unit = str(found["quantity_unit"].values[k])
        groups.setdefault((unit, values[:, k].tobytes()), []).append(str(path))
    fig = make_subplots(len(groups), 1, shared_xaxes=True, vertical_spacing=0.06)
    for row, ((unit, data), paths) in enumerate(groups.items(), start=1):
        unit, scale = _SHOWN.get(unit, (unit, 1.0))
        y = scale * np.frombuffer(data)
        fig.add_scatter(x=found["time"].values, y=y, mode="lines", line_color=BLACK, row=row, col=1)
        name = "<br>".join(path.removeprefix("body.").removeprefix("limbs.") for path in paths)
        title = {"text": f"{plain(name)}<br>({unit})".replace("&lt;br&gt;", "<br>"), "font": {"size": 11}}
        fig.update_yaxes(title=title, exponentformat="e", row=row, col=1)
    fig.update_xaxes(title="time (s)", row=len(groups), col=1)
    dress(fig, 120 + 150 * len(groups)).update_layout(margin_t=64, margin_l=120)
    _ribbon(fig, found)
    return Panel("What the modes set", "Quantities of the robot as the mission changes them.", fig)


def _ribbon(fig: go.Figure, found: xr.Dataset) -> None:
    """Colour the time of each mode and write its name above."""
    time, mode = found["time"].values, found["mode"].values
    first = np.flatnonzero(np.append(True, mode[1:] != mode[:-1]))
    for k, (a, b) in enumerate(zip(first, np.append(first[1:], time.size - 1), strict=True)):
        colour = _RIBBON[k % len(_RIBBON)]
        fig.add_vrect(x0=time[a], x1=time[b], fillcolor=colour, opacity=0.18, line_width=0, layer="below")  # pyright: ignore[reportArgumentType]
        above = {"y": 1.0, "yref": "paper", "yanchor": "bottom", "yshift": 6 + 16 * (k % 2)}
        font = {"size": 12, "color": BLACK}
        fig.add_annotation(
            text=readable(plain(mode[a])), x=0.5 * (time[a] + time[b]), xref="x", showarrow=False, font=font, **above
        )

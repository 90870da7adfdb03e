"""Figures of closed loops, of a simulated robot and of an experiment on a rig: reference, measurement and command.

Data, in SI units: of a robot as `ClosedLoopRecord.to_dataset` or its `signals` have them; of a rig as its log has them.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREY, SKY, Panel, dress, easy_unit, plain, readable, titled

_MOST = 6000  # points of a line that are drawn
_MOVED = 1e-3  # m, from which a path has a second direction
_MARKS = 10  # times that are marked on a path


def show_closed_loop(run: xr.Dataset, path: str | Path) -> None:
    """Write a page about a robot under a controller, whole or not at all. Raises InputError where it cannot."""
    ended = plain(f"{run.attrs['status']}: {run.attrs['status_reason']}")
    write_page(path, str(run.attrs["title"]), [f"<p>{ended}</p>", *closed_loop_panels(run)])


def closed_loop_panels(run: xr.Dataset) -> list[Panel]:
    """The signals of the loop, and the path of the body where it has two directions."""
    return [signals_panel(run), *([path_panel(run)] if len(_directions(run)) == 2 else [])]


def signals_panel(run: xr.Dataset) -> Panel:
    """Reference, measurement and command over time."""
    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06, row_heights=[0.62, 0.38])
    size, unit = easy_unit(run["reading"].values, run["reading"].attrs["units"])
    samples, time = run["sample"].values, run["time"].values
    every = slice(None, None, max(time.size // _MOST, 1))
    measured, output, reading = (size * run[name].values for name in ("measured", "output", "reading"))
    between = time.size > samples.size  # it is known between the samples too
    lines = [(time[every], reading[every], "true", {"color": SKY, "width": 1}, "linear")] if between else []
    shape = "linear" if np.array_equal(measured, output) else "hv"
    lines.append((samples, measured, "measured", {"color": BLUE, "width": 1.8}, shape))
    dashed = {"color": BLACK, "width": 1.8, "dash": "dash"}
    lines.append((samples, size * run["reference"].values, "reference", dashed, "linear"))
    for x, y, name, line, shape in lines:
        fig.add_scatter(x=x, y=y, name=name, mode="lines", line={**line, "shape": shape}, row=1, col=1)
    held = {"color": GREY, "width": 1.6, "shape": "hv"}
    command = run["command"]
    scale, of = easy_unit(command.values, command.attrs["units"])
    fig.add_scatter(x=samples, y=scale * command.values, name="command", mode="lines", line=held, row=2, col=1)
    fig.update_yaxes(title=titled(readable(str(run.attrs["measured"])), unit), row=1)
    fig.update_yaxes(title=titled(readable(str(run.attrs["commanded"]).rpartition(".")[2]), of), row=2)
    fig.update_xaxes(title="time (s)", row=2)
    dress(fig, 620).update_layout(showlegend=True, hovermode="closest", margin_t=60, legend_y=1.03)
    caption = "Simulated. The command is held from one sample to the next."
    if between and np.ptp(reading) > 0:
        caption += " The true reading is drawn between the samples too; the controller has the measured one."
    return Panel(f"{readable(plain(run.attrs['measured']))} by {plain(run.attrs['commanded'])}", caption, fig)


def path_panel(run: xr.Dataset) -> Panel:
    """Path of the body in the plane in which it moved furthest."""
    across, up = _directions(run)
    position, time = run["position"].isel(station=0).values, run["time"].values
    every = slice(None, None, max(time.size // _MOST, 1))
    x, y = (position[:, "xyz".index(axis)] for axis in (across, up))
    fig = go.Figure()
    fig.add_scatter(x=x[every], y=y[every], mode="lines", line={"color": BLUE, "width": 1.4}, name="path")
    marks = np.linspace(0.0, time[-1], _MARKS + 1)
    k = np.searchsorted(time, marks).clip(0, time.size - 1)
    marker = {"color": BLACK, "size": 6}
    texts, font = [f"{t:.3g} s" for t in marks], {"size": 11, "color": BLACK}
    style = {"mode": "markers+text", "marker": marker, "textposition": "top right", "textfont": font}
    fig.add_scatter(x=x[k], y=y[k], text=texts, **style)
    fig.update_xaxes(title=f"{across} (m)", constrain="domain")
    fig.update_yaxes(title=f"{up} (m)", scaleanchor="x")
    dress(fig, 460).update_layout(hovermode="closest")
    caption = f"Path of the first station of {plain(run['station_part'].values[0])}, to scale."
    return Panel("Seen from above" if up == "y" else "Seen from the side", caption, fig)


def show_experiment(runs: Sequence[xr.Dataset], path: str | Path) -> None:
    """Write a page about one or several experiments on a rig. Raises InputError where it cannot."""
    ended = plain(f"{runs[-1].attrs['status']}: {runs[-1].attrs['status_reason']}")
    loops = json.loads(runs[-1].attrs["loops"]).items()
    panels = [experiment_panel(runs, command, measurement) for command, measurement in loops]
    write_page(path, str(runs[-1].attrs["title"]), [f"<p>{ended}</p>", *panels])


def experiment_panel(runs: Sequence[xr.Dataset], of_command: str, of_measurement: str) -> Panel:
    """Signals of a loop in the last run, and its errors in all."""
    names = {of_measurement: "measured", f"{of_measurement}.reference": "reference", f"{of_command}.command": "command"}
    runs = [run[[*names]].rename(names) for run in runs]
    fig = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.45, 0.3, 0.25])
    several, latest = len(runs) > 1, runs[-1]
    size, unit = easy_unit(latest["reference"].values, latest["reference"].attrs["units"])
    scale, of = easy_unit(latest["command"].values, latest["command"].attrs["units"])
    for k, run in enumerate(runs):
        one = run.isel(time=slice(None, None, max(run.sizes["time"] // _MOST, 1)))
        time = one["time"].values
        measured, reference = size * one["measured"].values, size * one["reference"].values
        last = k == len(runs) - 1
        if last:
            for y, name, colour, width in ((reference, "reference", BLACK, 3.0), (measured, "measured", BLUE, 1.2)):
                line = {"color": colour, "width": width}
                fig.add_scatter(x=time, y=y, line=line, mode="lines", name=name, row=1, col=1)
            y, line = scale * one["command"].values, {"color": GREY, "width": 1.2}
            fig.add_scatter(x=time, y=y, line=line, mode="lines", name="command", row=3, col=1)
        line = {"color": BLUE if last else CYCLE[1 + k % (len(CYCLE) - 1)], "width": 1.0}
        name, y = f"error of run {k + 1}" if several else "error", measured - reference
        fig.add_scatter(x=time, y=y, line=line, mode="lines", name=name, showlegend=several, row=2, col=1)
    for row, (name, shown) in enumerate((("measured", unit), ("error", unit), ("command", of)), start=1):
        fig.update_yaxes(title=titled(name, shown), row=row)
    fig.update_xaxes(title="time (s)", row=3)
    dress(fig, 680).update_layout(showlegend=True, hovermode="closest", margin_t=60, legend_y=1.07)
    caption = "As measured, with noise. The command acts on the rig after its delay." + (
        " Of runs before the last one only the error is drawn." if several else ""
    )
    return Panel(f"{plain(of_measurement)} by {plain(of_command)}", caption, fig)


def _directions(run: xr.Dataset) -> tuple[str, ...]:
    """The two axes of the world along which the body moved furthest; fewer where it did not move along them."""
    far = np.ptp(run["position"].isel(station=0).values, axis=0)
    furthest = sorted(np.argsort(far)[-2:])
    return tuple("xyz"[k] for k in furthest if far[k] > _MOVED)

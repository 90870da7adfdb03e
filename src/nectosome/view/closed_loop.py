"""Figures of a robot under a controller: reference and measurement, the command, and the path of the body.

Data as `control.Followed.to_dataset` gives it, or `track`.
"""

from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from nectosome.units import DIMENSIONS, show_quantity, unit_to_si

from .page import write_page
from .style import BLACK, BLUE, GREY, SKY, Panel, dress, plain, readable

if TYPE_CHECKING:
    import xarray as xr

_MOST = 6000  # points of a line that are drawn
_MOVED = 1e-3  # m, from which on a path has a second direction
_MARKS = 10  # times that are marked on it


def show_following(run: "xr.Dataset", path: str | Path) -> None:
    """Write a page about one run, whole or not at all. Raises InputError where it cannot be written."""
    ended = f"{run.attrs['status']}: {run.attrs['status_reason']}"
    write_page(path, str(run.attrs["title"]), [f"<p>{escape(ended)}</p>", *following_panels(run)])


def following_panels(run: "xr.Dataset") -> list[Panel]:
    """Tracking of the reference, and the path of the body where that has two directions."""
    return [followed_panel(run), *([path_panel(run)] if len(_directions(run)) == 2 else [])]


def followed_panel(run: "xr.Dataset") -> Panel:
    """Reference, measurement and command over time."""
    from plotly.subplots import make_subplots

    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06, row_heights=[0.62, 0.38])
    size, unit = _shown(run["reading"])
    time, instants = run["sample"].values, run["time"].values
    every = slice(None, None, max(instants.size // _MOST, 1))
    measured, output, reading = (size * run[name].values for name in ("measured", "output", "reading"))
    inside = instants.size > time.size  # it is known between the samples too
    lines = [(instants[every], reading[every], "as it is", {"color": SKY, "width": 1}, "linear")] if inside else []
    shape = "linear" if np.array_equal(measured, output) else "hv"
    lines.append((time, measured, "as measured", {"color": BLUE, "width": 1.8}, shape))
    wanted = {"color": BLACK, "width": 1.8, "dash": "dash"}
    lines.append((time, size * run["reference"].values, "reference", wanted, "linear"))
    for x, y, name, line, shape in lines:
        fig.add_scatter(x=x, y=y, name=name, mode="lines", line={**line, "shape": shape}, row=1, col=1)
    held = {"color": GREY, "width": 1.6, "shape": "hv"}
    command = run["command"]
    scale, of = _shown(command)
    fig.add_scatter(x=time, y=scale * command.values, name="command", mode="lines", line=held, row=2, col=1)
    fig.update_yaxes(title=_named(str(run.attrs["measured"]), unit), row=1)
    fig.update_yaxes(title=_named(str(run.attrs["commanded"]).rpartition(".")[2], of), row=2)
    fig.update_xaxes(title="time (s)", row=2)
    dress(fig, 620).update_layout(showlegend=True, hovermode="closest", margin_t=60, legend_y=1.03)
    caption = "Simulated. The command is held from one sample to the next."
    if inside and np.ptp(reading) > 0:
        caption += " What beats is drawn as it is, and as the controller was told."
    return Panel(f"{readable(plain(run.attrs['measured']))} by {plain(run.attrs['commanded'])}", caption, fig)


def path_panel(run: "xr.Dataset") -> Panel:
    """Path of the body in the plane in which it went furthest."""
    import plotly.graph_objects as go

    across, up = _directions(run)
    place, instants = run["position"].isel(station=0).values, run["time"].values
    every = slice(None, None, max(instants.size // _MOST, 1))
    x, y = (place[:, "xyz".index(axis)] for axis in (across, up))
    fig = go.Figure()
    fig.add_scatter(x=x[every], y=y[every], mode="lines", line={"color": BLUE, "width": 1.4}, name="path")
    marks = np.linspace(0.0, instants[-1], _MARKS + 1)
    k = np.searchsorted(instants, marks).clip(0, instants.size - 1)
    marker = {"color": BLACK, "size": 6}
    texts = [f"{t:.3g} s" for t in marks]
    style = {"size": 11, "color": BLACK}
    fig.add_scatter(
        x=x[k], y=y[k], mode="markers+text", text=texts, textposition="top right", textfont=style, marker=marker
    )
    fig.update_xaxes(title=f"{across} (m)", constrain="domain")
    fig.update_yaxes(title=f"{up} (m)", scaleanchor="x")
    dress(fig, 460).update_layout(hovermode="closest")
    caption = f"Way of the first station of {plain(run['station_part'].values[0])}, to scale."
    return Panel("Seen from above" if up == "y" else "Seen from the side", caption, fig)


def _directions(run: "xr.Dataset") -> tuple[str, ...]:
    """The two axes of the world along which the body went furthest; fewer where it did not move along them."""
    far = np.ptp(run["position"].isel(station=0).values, axis=0)
    furthest = sorted(np.argsort(far)[-2:])
    return tuple("xyz"[k] for k in furthest if far[k] > _MOVED)


def _shown(values: "xr.DataArray") -> tuple[float, str]:
    """Factor from SI to the unit in which people like to read the largest of some values, and that unit."""
    unit = str(values.attrs["units"])
    dimension = next((name for name, kind in DIMENSIONS.items() if kind.unit == unit), None)
    if dimension is None:
        return 1.0, unit
    shown = show_quantity(float(np.abs(values.values).max()), dimension).partition(" ")[2]
    return 1 / unit_to_si(shown)[0], shown


def _named(name: str, unit: str) -> str:
    return f"{readable(plain(name))} ({unit})" if unit not in ("", "1") else readable(plain(name))

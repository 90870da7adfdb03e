"""Pages of recordings, every quantity over time, and of what was tracked in videos, with gaps as gaps."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_page
from .style import BLACK, CYCLE, Panel, dress, plain, titled


def show_track(tracked: xr.Dataset, path: str | Path) -> None:
    """Write a page with what was tracked. Raises InputError where it cannot."""
    panel = marker_panel(tracked) if "marker" in tracked else segment_panel(tracked)
    write_page(path, str(tracked.attrs["title"]), [panel])


def segment_panel(tracked: xr.Dataset) -> Panel:
    """Directions of segments, angles of joints, and quality."""
    fig, time = _figure("direction (deg)", "joint angle (deg)", "quality"), tracked["time"].values
    names = [str(name) for name in tracked["segment"].values]
    for k, name in enumerate(names):
        _line(fig, time, np.rad2deg(tracked["direction"].values[:, k]), name, k, 1)
        _line(fig, time, tracked["quality"].values[:, k], name, k, 3, legend=False)
    for k, name in enumerate(str(joint) for joint in tracked["joint"].values):
        _line(fig, time, np.rad2deg(tracked["joint_angle"].values[:, k]), f"joint {name}", k + 1, 2)
    fig.update_yaxes(range=[0, 1.05], row=3)
    caption = "Directions are counter-clockwise from x. Gaps are frames in which a segment was not seen well. " + _odd(
        tracked
    )
    return Panel("Segments", caption, fig)


def marker_panel(tracked: xr.Dataset) -> Panel:
    """Place and angles of the body, with two standard errors, and what the markers are off."""
    fig, time = _figure("place (mm)", "angle (deg)", "misfit (mm)"), tracked["time"].values
    for row, name, dim, factor in ((1, "position", "axis", 1e3), (2, "angle", "turn", 180 / np.pi)):
        for k, label in enumerate(str(x) for x in tracked[dim].values):
            value = factor * tracked[name].values[:, k]
            error = 2 * factor * tracked[f"{name}_se"].values[:, k]
            colour = CYCLE[k + 3 * (row - 1)]
            for sign in (-1, 1):
                fill = {"fill": "tonexty", "fillcolor": colour, "opacity": 0.3} if sign > 0 else {}
                fig.add_scatter(
                    x=time, y=value + sign * error, line={"width": 0}, mode="lines", showlegend=False,
                    hoverinfo="skip", row=row, col=1, **fill,
                )  # fmt: skip
            fig.add_scatter(x=time, y=value, line={"color": colour, "width": 1.5}, name=label, row=row, col=1)
    misfit = 1e3 * tracked["misfit"].values
    fig.add_scatter(
        x=time, y=misfit, line={"color": BLACK, "width": 1.2}, name="misfit", showlegend=False, row=3, col=1
    )
    fig.update_yaxes(rangemode="tozero", row=3)
    caption = (
        "Origin of the body's frame in the tank; bands are two standard errors, of pixels only. The misfit is the rms "
        "of what markers are off the body. " + _odd(tracked)
    )
    return Panel("Pose of the body", caption, fig)


def _figure(*titles: str) -> go.Figure:
    """Three plots over time, the last one small."""
    fig = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.4, 0.4, 0.2])
    for row, title in enumerate(titles, start=1):
        fig.update_yaxes(title=title, row=row)
    fig.update_xaxes(title="time (s)", row=3)
    return dress(fig, 760).update_layout(showlegend=True, hovermode="closest", margin_t=80, legend_y=1.1)


def _line(fig: go.Figure, x: np.ndarray, y: np.ndarray, name: str, k: int, row: int, legend: bool = True) -> None:
    line = {"color": CYCLE[k % len(CYCLE)], "width": 1.5}
    fig.add_scatter(x=x, y=y, line=line, mode="lines", name=plain(name), showlegend=legend, row=row, col=1)


def _odd(tracked: xr.Dataset) -> str:
    said = json.loads(tracked.attrs["provenance"])["warnings"]
    return f"{'; '.join(said)}." if said else "Nothing odd was found."


_POINTS = 4000  # of a line; more are drawn as the range of each stretch
_READ = 1_000_000  # samples at a time


def show_recordings(recordings: Sequence[xr.Dataset], path: str | Path) -> None:
    """Write a page with a plot of each quantity of each recording. Raises InputError where it cannot."""
    parts = []
    for recording in recordings:
        parts += [f"<h2>{plain(str(recording.attrs['title']))}</h2>", recording_panel(recording)]
    write_page(path, "Recordings", parts)


def recording_panel(recording: xr.Dataset) -> Panel:
    """All quantities of a recording, one above the other."""
    about = json.loads(recording.attrs["provenance"])
    names = list(recording.data_vars)
    fig = make_subplots(rows=len(names), cols=1, shared_xaxes=True, vertical_spacing=0.25 / (10 * len(names)))
    for k, name in enumerate(names):
        x, y = _outline(recording[name])
        fig.add_scatter(x=x, y=y, line={"color": CYCLE[k % len(CYCLE)], "width": 1.2}, row=k + 1, col=1)
        text = titled(name, recording[name].attrs["units"]).replace(" (", "<br>(")
        fig.update_yaxes(title={"text": text, "font": {"size": 12}}, row=k + 1, col=1)
    dim = str(recording[names[0]].dims[0])
    fig.update_xaxes(title="time (s)" if dim == "time" else "row", row=len(names), col=1)
    dress(fig, 90 + 150 * len(names)).update_layout(hovermode="closest")
    fig.update_layout(margin_l=100)
    said = [*about["repairs"], *about["warnings"]]
    name = Path(about["file"]).name + (f" [{about['part']}]" if about["part"] else "")
    caption = f"{name}, read as {about['reader']}. {'; '.join(said) or 'Nothing odd was found'}."
    return Panel("As read", caption, fig)


def _outline(variable: xr.DataArray) -> tuple[np.ndarray, np.ndarray]:
    """Points of a line; of many samples the smallest and largest of each stretch, so that no peak is lost."""
    along = variable[variable.dims[0]]
    if variable.size <= _POINTS:
        return along.values, variable.values
    width = -(-variable.size // (_POINTS // 2))
    block = width * max(1, _READ // width)
    xs, ys = [], []
    for start in range(0, variable.size, block):  # what is larger than memory stays in its file
        y = variable[start : start + block].values
        starts = np.arange(0, y.size, width)
        xs.append(np.repeat(along[start : start + block].values[starts], 2))
        ys.append(np.stack([f.reduceat(y, starts) for f in (np.fmin, np.fmax)], axis=1).ravel())
    return np.concatenate(xs), np.concatenate(ys)

"""Recordings as people look at them: every quantity over time. Apart from `series`, which needs JAX."""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_page
from .style import CYCLE, Panel, dress, plain

_POINTS = 4000  # of a line; more are drawn as the range of each stretch
_READ = 1_000_000  # samples at a time


def show_recordings(recordings: Sequence[xr.Dataset], path: str | Path) -> None:
    """Write a page with a plot of each quantity of each recording. Raises InputError where it cannot."""
    parts = []
    for recording in recordings:
        parts += [f"<h2>{plain(str(recording.attrs['title']))}</h2>", _panel(recording)]
    write_page(path, "Recordings", parts)


def _panel(recording: xr.Dataset) -> Panel:
    """All quantities of a recording, one above the other."""
    about = json.loads(recording.attrs["provenance"])
    names = list(recording.data_vars)
    fig = make_subplots(rows=len(names), cols=1, shared_xaxes=True, vertical_spacing=0.25 / (10 * len(names)))
    for k, name in enumerate(names):
        x, y = _outline(recording[name])
        fig.add_scatter(x=x, y=y, line={"color": CYCLE[k % len(CYCLE)], "width": 1.2}, row=k + 1, col=1)
        unit = recording[name].attrs["units"] or "1"
        fig.update_yaxes(title={"text": f"{plain(name)}<br>({plain(unit)})", "font": {"size": 12}}, row=k + 1, col=1)
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

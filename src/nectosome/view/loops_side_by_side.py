"""The page of several controllers of one robot: reference and output of each on one axis, their commands below.

Data, in SI units, as `ControllerComparison.to_dataset` has them.
"""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.units import InputError

from .page import write_page
from .style import BLACK, CYCLE, GREY, Panel, dress, easy_unit, plain, readable, titled

_MOST = 6000  # points of a line that are drawn
_DASHES = ("solid", "dot", "dashdot")  # one for each round of the colours


def show_side_by_side(found: xr.Dataset, path: str | Path) -> None:
    """Write a page about controllers that were compared. Raises InputError for others, and where it cannot write."""
    if "controller" not in found.dims or "outcome" not in found.coords:
        raise InputError("this dataset has no controllers that were compared.")
    causes = zip(found["controller"].values, found["outcome"].values, found["cause"].values, strict=True)
    said = (f"{name}{', refused' * (outcome == 'refused')}: {cause}" for name, outcome, cause in causes if cause)
    write_page(
        path, str(found.attrs["title"]), [signals_side_by_side(found), *(f"<p>{plain(one)}</p>" for one in said)]
    )


def signals_side_by_side(found: xr.Dataset) -> Panel:
    """Reference and outputs over time, and commands below, which share colours; the range of the command in grey."""
    fig = make_subplots(2, 1, shared_xaxes=True, vertical_spacing=0.06, row_heights=[0.62, 0.38])
    command, measured = found["command"], readable(str(found.attrs["measured"]))
    size, unit = easy_unit(_values(found["reference"], found["output"]), found["reference"].attrs["units"])
    low, high = map(float, found.attrs["command_range"])
    scale, of = easy_unit(np.array([low, high]), command.attrs["units"])
    every = slice(None, None, max(found.sizes["sample"] // _MOST, 1))
    time = found["sample"].values[every]
    drawn = [k for k, error in enumerate(found["output"].values) if np.isfinite(error).any()]
    for n, k in enumerate(drawn):
        name, error = str(found["controller"].values[k]), size * float(found["rms_error"].values[k])
        line = {"color": CYCLE[n % len(CYCLE)], "dash": _DASHES[n // len(CYCLE) % len(_DASHES)], "width": 1.6}
        label = f"{name}, rms error {error:.3g} {unit}".strip() if np.isfinite(error) else f"{name}, ended early"
        shared = {"x": time, "mode": "lines", "legendgroup": name}
        y = size * found["output"].values[k][every]
        fig.add_scatter(**shared, y=y, name=plain(label), line=line, row=1, col=1)
        y = scale * command.values[k][every]
        held = {**line, "shape": "hv", "width": 1.3}
        fig.add_scatter(**shared, y=y, name=plain(name), showlegend=False, line=held, row=2, col=1)
    dashed = {"color": BLACK, "width": 1.6, "dash": "dash"}
    y = size * found["reference"].values[every]
    fig.add_scatter(x=time, y=y, name="reference", mode="lines", line=dashed, row=1, col=1)
    if (found["at_limits"].values > 0).any():
        _ends(fig, scale * low, scale * high)
    fig.update_yaxes(title=titled(measured, unit), row=1)
    fig.update_yaxes(title=titled(readable(str(found.attrs["commanded"]).rpartition(".")[2]), of), row=2)
    fig.update_xaxes(title="time (s)", row=2)
    dress(fig, 660).update_layout(showlegend=True, hovermode="closest", margin_t=84, legend_y=1.03)
    caption = "Simulated; outputs are without delay and noise of the sensor. Commands are held from sample to sample"
    caption += "; grey lines are the ends of their range." if (found["at_limits"].values > 0).any() else "."
    return Panel(f"{measured} by {plain(found.attrs['commanded'])}", caption, fig)


def _ends(fig: go.Figure, *values: float) -> None:
    for value in values:
        fig.add_hline(y=value, line={"color": GREY, "width": 1, "dash": "dot"}, row=2, col=1)  # pyright: ignore[reportArgumentType]


def _values(*variables: xr.DataArray) -> np.ndarray:
    return np.concatenate([variable.values.ravel() for variable in variables])

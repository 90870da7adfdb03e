"""Figures of a body in surge: speeds measured and computed.

Data as `identification.surge_data` has it.
"""

from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from .page import write_fit
from .style import BLACK, BLUE, GREY, VERMILLION, Panel, dress

_SHOWN = 3.0  # s of thrust and speed at first: single cycles can be seen
PARAMETERS = {"added_mass": "added mass", "drag": "drag"}


def show_surge(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    write_fit(found, path, parameter_sentence(found), recording_panel)


def parameter_sentence(found: xr.Dataset) -> str:
    """The parameters with their intervals, in a sentence."""
    parts = []
    for name in PARAMETERS:
        one = found.sel(parameter=name)
        value, low, high = (f"{float(one[key]):.4g}" for key in ("value", "low", "high"))
        parts.append(f"{PARAMETERS[name]} {value} {one['unit'].item()} (95 %: {low} to {high})")
    return f"By {found.attrs['method']}: {', '.join(parts)}."


def recording_panel(found: xr.Dataset, k: int, other: xr.Dataset | None = None, called: str = "measured") -> Panel:
    """Thrust, speed, its residual and the distance, of one recording; `other` is identified in another way."""
    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    time, measured, computed = (one[name].values for name in ("time", "measured", "computed"))
    titles = ("thrust (N)", "speed (m/s)", f"{called} - identified (m/s)", "distance (m)")
    fig = make_subplots(4, 1, vertical_spacing=0.07, row_heights=[0.22, 0.3, 0.2, 0.28])
    thin: dict[str, Any] = {"mode": "lines", "showlegend": False}
    fig.add_scatter(x=time, y=one["thrust"].values, line_color=BLACK, row=1, col=1, **thin)
    curves = [(called, measured, GREY, "solid"), ("identified", computed, BLUE, "solid")]
    if other is not None:
        theirs = other["computed"].values[other["of"].values == k]
        curves.append(("identified as printed", theirs, VERMILLION, "dash"))
    for name, speed, colour, dash in curves:
        line = {"color": colour, "dash": dash, "width": 1.5 if name == called else 2}
        fig.add_scatter(x=time, y=speed, name=name, mode="lines", line=line, row=2, col=1)
        fig.add_scatter(x=time, y=_distance(time, speed), line=line, row=4, col=1, **thin)
    fig.add_scatter(x=time, y=measured - computed, line_color=GREY, row=3, col=1, **thin)
    for row, title in enumerate(titles, start=1):
        fig.update_yaxes(title={"text": title.replace(" (", "<br>("), "font": {"size": 12}}, row=row, col=1)
    start = float(time[0])
    for row in (1, 2, 3):
        fig.update_xaxes(matches="x", range=[start, min(float(time[-1]), start + _SHOWN)], row=row, col=1)
    fig.update_xaxes(title="time (s)", row=4, col=1)
    dress(fig, 760).update_layout(showlegend=True, margin_t=60, margin_l=96)
    used = "that was fitted" if one["used"].item() == "train" else "that was not fitted"
    mean, std, most = (round(float(one[f"deviation_{name}"]), 2) + 0.0 for name in ("mean", "std", "largest"))
    caption = (
        f"A recording {used}, {one['recording'].item()}. Error of the speed in percent of its root mean square: mean "
        f"{mean:.2f}, standard deviation {std:.3g}, largest {most:.3g}. The first {_SHOWN:g} s are shown; zoom out for "
        "more."
    )
    return Panel(f"Speed, {one['recording'].item()}", caption, fig)


def _distance(time: Float[np.ndarray, "n"], speed: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Distance from the first sample on: trapezoids [m]."""
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1]))])

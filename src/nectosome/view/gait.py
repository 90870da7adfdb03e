"""Figures of a fit of gaits: how it went, what it found in the ranges, and the motion it comes to.

Data: as `to_dataset` of `identification.GaitResult` has it; of several fits one after the other.
"""

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREY, VERMILLION, Panel, dress, plain


def show_gait(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with all figures. Raises InputError where it cannot."""
    known = "".join(f"<li>{plain(words)}</li>" for words in json.loads(found.attrs["words"]))
    shown = [history_panel([found]), parameters_panel([found]), motion_panel(found)]
    write_page(path, str(found.attrs["title"]), [f"<p>Identifiability by the features:</p><ul>{known}</ul>", *shown])


def history_panel(fits: Sequence[xr.Dataset], names: Sequence[str] = ("",), printed: float | None = None) -> Panel:
    """The lowest discrepancy so far, and the printed one."""
    fig = go.Figure()
    for k, (fit, name) in enumerate(zip(fits, names, strict=True)):
        best = np.minimum.accumulate(fit["discrepancy"].values)
        line = {"color": CYCLE[k % len(CYCLE)], "shape": "hv"}
        fig.add_scatter(x=np.arange(1, best.size + 1), y=best, mode="lines", line=line, name=plain(name or "lowest"))
    if printed is not None:
        most = max(fit.sizes["evaluation"] for fit in fits)
        line = {"color": BLACK, "dash": "dot"}
        fig.add_scatter(x=[1, most], y=[printed, printed], mode="lines", line=line, name="printed")
    fig.update_xaxes(title="walks")
    fig.update_yaxes(title="lowest discrepancy (eq. 13)", type="log", exponentformat="power")
    dress(fig, 360).update_layout(showlegend=len(fits) > 1 or printed is not None, margin_t=60)
    return Panel("Search", "Sum of the squared relative errors of the features, of the best candidate so far.", fig)


def parameters_panel(fits: Sequence[xr.Dataset], names: Sequence[str] = ("",)) -> Panel:
    """Where in their ranges parameters are found, and where candidates that are as good lie."""
    fig = go.Figure()
    for k, (fit, name) in enumerate(zip(fits, names, strict=True)):
        low, size = fit["low"].values, (fit["high"] - fit["low"]).values
        place = {key: 100 * (fit[key].values - low) / size for key in ("value", "good_low", "good_high")}
        bars = {"array": place["good_high"] - place["value"], "arrayminus": place["value"] - place["good_low"]}
        rows = np.arange(fit.sizes["parameter"]) + 0.12 * (k - (len(fits) - 1) / 2)
        marker = {"color": CYCLE[k % len(CYCLE)], "size": 8}
        hover = [f"{x:.4g} {unit}" for x, unit in zip(fit["value"].values, fit["unit"].values, strict=True)]
        style = {"mode": "markers", "marker": marker, "text": hover, "hovertemplate": "%{text}<extra></extra>"}
        error = {**bars, "thickness": 2, "width": 3}
        fig.add_scatter(x=place["value"], y=rows, error_x=error, name=plain(name or "best"), **style)
    labels = [plain(str(name)) for name in fits[0]["parameter"].values]
    fig.update_yaxes(tickvals=list(range(len(labels))), ticktext=labels, autorange="reversed", zeroline=False)
    fig.update_xaxes(title="place in the range (percent)", range=(-3, 103))
    dress(fig, 140 + 34 * len(labels)).update_layout(showlegend=len(fits) > 1, margin_l=130, margin_t=60)
    caption = "Dots: the best of each search. Bars: between them lie candidates that are as good."
    return Panel("Parameters found", caption, fig)


def motion_panel(found: xr.Dataset) -> Panel:
    """Positions and tilt of the best candidate in the window, trial by trial."""
    titles = ("position z (mm)", "position x (mm)", "tilt (deg)")
    fig = make_subplots(1, 3, subplot_titles=titles, horizontal_spacing=0.07)
    for trial in range(found.sizes["trial"]):
        line = {"color": (BLUE, VERMILLION, GREY, BLACK)[trial % 4], "width": 1.5}
        one = found.isel(trial=trial)
        values = 1e3 * one["position.z"].values, 1e3 * one["position.x"].values, np.degrees(one["tilt"].values)
        for col, y in enumerate(values, start=1):
            name = f"trial {trial + 1}"
            x = found["time"].values
            fig.add_scatter(x=x, y=y, line=line, name=name, showlegend=col == 1, row=1, col=col)
    fig.update_xaxes(title="time in the window (s)")
    dress(fig, 350).update_layout(showlegend=found.sizes["trial"] > 1, margin_t=64)
    return Panel("Motion of the best candidate", "Simulated, in the last part of the walk.", fig)

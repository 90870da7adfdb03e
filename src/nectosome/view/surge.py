"""Figures of a body in surge: speeds measured and computed, and what estimators of its parameters are worth.

Data: `swim` as `identify.surge_data` has it; of the study of PoseiDRONE also `swim_as_printed`, the same by the printed
estimator, and `swim_draws`: value (way, draw, parameter), truth (parameter), bias, coverage [percent] (way, parameter).
"""

import json
from collections.abc import Mapping
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREY, ORANGE, VERMILLION, Panel, dress, plain

if TYPE_CHECKING:
    import xarray as xr

Sets = Mapping[str, "xr.Dataset"]
_SHOWN = 3.0  # s of thrust and speed at first: cycles can be told apart
_MOST = 50.0  # percent, of errors that are shown
_NAMES = {"added_mass": "added mass", "drag": "drag"}


def show_surge(found: "xr.Dataset", path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    warnings = [f"<p><b>Beware:</b> {escape(words)}.</p>" for words in json.loads(found.attrs["warnings"])]
    panels = [recording_panel(found, k) for k in range(found.sizes["recording"])]
    write_page(path, str(found.attrs["title"]), [f"<p>{escape(told_of(found))}</p>", *warnings, *panels])


def panels(sets: Sets) -> list[Panel]:
    """Figs. 9 and 10 on synthetic recordings, and the estimators."""
    found, other = sets["swim"], sets["swim_as_printed"]
    shown = [recording_panel(found, k, other, "synthetic") for k in range(found.sizes["recording"])]
    note = " The paper published no recordings: this one is synthetic."
    named = zip(shown, ("Fig. 9", "Fig. 10"), strict=True)
    shown = [panel._replace(title=f"{panel.title}, as {f}", caption=panel.caption + note) for panel, f in named]
    return [*shown, estimators_panel(sets["swim_draws"])]


def told_of(found: "xr.Dataset") -> str:
    """The parameters with their intervals, in a sentence."""
    parts = []
    for name in _NAMES:
        one = found.sel(parameter=name)
        value, low, high = (f"{float(one[key]):.4g}" for key in ("value", "low", "high"))
        parts.append(f"{_NAMES[name]} {value} {one['unit'].item()} (95 %: {low} to {high})")
    return f"By {found.attrs['method']}: {', '.join(parts)}."


def recording_panel(found: "xr.Dataset", k: int, other: "xr.Dataset | None" = None, called: str = "measured") -> Panel:
    """Thrust, speed, what is left of it, and the way, of one recording; `other` is found by the printed method."""
    from plotly.subplots import make_subplots

    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    time, measured, computed = (one[name].values for name in ("time", "measured", "computed"))
    titles = ("thrust (N)", "speed (m/s)", f"{called} - identified (m/s)", "way (m)")
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
        fig.add_scatter(x=time, y=_way(time, speed), line=line, row=4, col=1, **thin)
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


def _way(time: Float[np.ndarray, "n"], speed: Float[np.ndarray, "n"]) -> Float[np.ndarray, "n"]:
    """Distance from the first sample on: trapezoids [m]."""
    return np.concatenate([[0.0], np.cumsum(0.5 * np.diff(time) * (speed[1:] + speed[:-1]))])


def estimators_panel(made: "xr.Dataset") -> Panel:
    """What each way finds in many draws of noise, and how often its intervals hold the truth."""
    from plotly.subplots import make_subplots

    names = [str(name) for name in made["parameter"].values]
    ways = [str(way) for way in made["way"].values]
    fig = make_subplots(1, 3, shared_yaxes=True, horizontal_spacing=0.03, column_widths=[0.37, 0.37, 0.26])
    off = 100 * (made["value"] / made["truth"] - 1)
    for col, name in enumerate(names, start=1):
        for k, way in enumerate(ways):
            x = off.sel(parameter=name, way=way).values
            box: dict[str, Any] = {"boxpoints": False, "boxmean": True, "line_color": CYCLE[k % len(CYCLE)]}
            fig.add_box(x=x, y=[plain(way)] * x.size, orientation="h", **box, row=1, col=col)
        fig.update_xaxes(title=f"error of {_NAMES[name]} (percent)", row=1, col=col)
        fig.update_xaxes(range=[-15, _MOST], row=1, col=col)
    for name, colour, symbol in zip(names, (BLUE, ORANGE), ("circle", "diamond"), strict=True):
        marker = {"color": colour, "size": 10, "symbol": symbol}
        x, y = made["coverage"].sel(parameter=name).values, [plain(way) for way in ways]
        fig.add_scatter(x=x, y=y, mode="markers", marker=marker, name=f"coverage, {_NAMES[name]}", row=1, col=3)
    fig.add_vline(x=95, line={"color": BLACK, "dash": "dash", "width": 1}, row=1, col=3)  # pyright: ignore[reportArgumentType]
    fig.update_xaxes(title="95 % intervals that hold (percent)", range=[-4, 104], row=1, col=3)
    fig.update_yaxes(autorange="reversed")
    beyond = [
        f" {way[:1].upper()}{way[1:]} the {_NAMES[name]} is off by {x:.0f} %, which is not shown."
        for way in ways
        for name in names
        if (x := float(made["bias"].sel(way=way, parameter=name))) > _MOST
    ]
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest", margin_l=150, margin_t=50)
    fig.for_each_trace(lambda trace: trace.update(showlegend=trace.type == "scatter"))
    caption = (
        f"Synthetic recordings, {made.sizes['draw']} draws of noise: errors of what is found (boxes hold half of them, "
        "the dashed line is the mean), and the share of 95 % intervals that hold the truth. As printed: eqs. 4 to 9 "
        f"behind a Savitzky-Golay filter on the speed alone.{''.join(beyond)}"
    )
    return Panel("What estimators are worth", caption, fig)

"""Figures of RExEel: tracks of its head, position and yaw over time, distance by amplitude, and tables."""

from typing import Any

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.view.scorecard import plain_table
from nectosome.view.style import BLACK, BLUE, GREEN, GREY, ORANGE, PURPLE, VERMILLION, Panel, dress

from .. import charts
from ..study import Sets
from .tables import TextTable, by_piece, compared, errors_beside, verdict

# of the authors' codes, from their data and figures: distance of the head in 3.967 s [m], and peak-to-peak yaw [deg].
# Genesis' tracks have no yaw; of Navier-Stokes only the swim at 40 deg is published
CODES: dict[str, dict[str, dict[int, float]]] = {
    "distance": {"Navier-Stokes": {40: 0.484}, "Genesis": {10: 0.0071, 20: 0.038, 30: 0.091, 40: 0.1445}},
    "yaw_swing": {"Navier-Stokes": {40: 95.6}},
}
_LIGHT = "#b9bec5"


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """Figures and tables of `swims` and `pieces`."""
    del runs
    swims, pieces = data["swims"], data["pieces"]
    return [
        _table("RExEel: measured and predicted", f"{_COMPARED} {verdict(swims)}", compared(swims)),
        _tracks(swims),
        charts.panels("rexeel", data)["Over time"],
        _by_amplitude(swims, pieces),
        _table("Errors as the authors compute them", _ERRORS, errors_beside(swims)),
        _table("Which piece of the water matters how much", _PIECES, by_piece(swims, pieces)),
    ]


def _tracks(swims: xr.Dataset) -> Panel:
    """The head's tracks from above, amplitude by amplitude."""
    amplitudes = swims["amplitude"].values
    titles = [f"{k} deg" for k in amplitudes]
    fig = make_subplots(rows=1, cols=len(amplitudes), shared_yaxes=True, subplot_titles=titles, horizontal_spacing=0.03)
    for i, k in enumerate(amplitudes, start=1):
        one = swims.sel(amplitude=k)
        x, y = (_together(one[f"measured_{name}"].values) for name in ("x", "y"))
        shown: dict[str, Any] = {"row": 1, "col": i, "mode": "lines", "showlegend": i == 1}
        fig.add_scatter(x=x, y=y, name="measured, each swim", line={"color": _LIGHT, "width": 1}, **shown)
        for angles, line in _LINES.items():
            ours = one.sel(angles=angles)
            fig.add_scatter(x=100 * ours["x"], y=100 * ours["y"], name=f"predicted, {angles}", line=line, **shown)
        fig.update_xaxes(title="across (cm)", range=[-7, 22], row=1, col=i)
        fig.update_yaxes(scaleanchor=f"x{i if i > 1 else ''}", range=[-4, 72], row=1, col=i)
    fig.update_yaxes(title="along the tank (cm)", row=1, col=1)
    dress(fig, 640).update_layout(hovermode="closest", showlegend=True, margin_t=72, legend_y=1.05)
    caption = (
        "Tracks of the middle of the head, seen from above, from rest to 4 s: all recorded swims, and those predicted "
        "from the commanded and the logged angles of the motors."
    )
    return Panel("Tracks of the head", caption, fig)


_LINES = {"commanded": {"color": BLUE, "width": 2.5}, "logged": {"color": VERMILLION, "width": 1.5, "dash": "dash"}}


def _together(values: np.ndarray) -> np.ndarray:
    """Curves (swim, frame) [m] as one with gaps, in cm."""
    there = 100 * values[np.isfinite(values[:, 0])]
    return np.concatenate([there, np.full((len(there), 1), np.nan)], axis=1).ravel()


def _by_amplitude(swims: xr.Dataset, pieces: xr.Dataset) -> Panel:
    """Distance and peak-to-peak yaw by amplitude: measured, ours, other codes, two extremes of what is shed."""
    fig, x = make_subplots(rows=1, cols=2, horizontal_spacing=0.12), swims["amplitude"].values
    for col, (name, title, factor) in enumerate(
        (("distance", "distance in 3.97 s (cm)", 100.0), ("yaw_swing", "peak-to-peak yaw (deg)", 1.0)), start=1
    ):
        here: dict[str, Any] = {"row": 1, "col": col, "showlegend": col == 1}
        ours = swims[name].sel(angles="commanded")
        curves = (
            ("predicted", ours, {"color": BLUE, "width": 2.5}),
            ("shed at once", pieces[name].sel(piece="instant"), {"color": ORANGE, "dash": "dash"}),
            ("nothing shed", pieces[name].sel(piece="nothing-shed"), {"color": GREEN, "dash": "dot"}),
        )
        for label, values, line in curves:
            fig.add_scatter(x=x, y=factor * values.values, mode="lines+markers", name=label, line=line, **here)
        for code, colour, symbol in (("Navier-Stokes", PURPLE, "diamond"), ("Genesis", GREY, "square")):
            known = CODES[name].get(code, {})
            marker = {"color": colour, "symbol": symbol, "size": 9}
            y = [factor * value for value in known.values()]
            fig.add_scatter(x=[*known], y=y, mode="markers", name=code, marker=marker, **here)
        theirs = factor * swims[f"measured_{name}"]
        bars = {"array": theirs.std("swim", ddof=1).values, "color": BLACK}
        measured = {"x": x, "y": theirs.mean("swim").values, "error_y": bars, "marker": {"color": BLACK, "size": 7}}
        fig.add_scatter(mode="markers", name="measured ± standard deviation", **measured, **here)
        fig.update_xaxes(title="amplitude of the motors (deg)", tickvals=x, row=1, col=col)
        fig.update_yaxes(title=title, rangemode="tozero", row=1, col=col)
    dress(fig, 440).update_layout(hovermode="closest", showlegend=True, margin_t=84)
    caption = (
        "What is shed at the tail decides: the same robot with a last link that sheds at once (Lighthill's limit), and "
        "with one that sheds nothing. Of Navier-Stokes only the swim at 40 deg is published, of Genesis no yaw."
    )
    return Panel("By amplitude", caption, fig)


def _table(title: str, caption: str, table: TextTable) -> Panel:
    return Panel(title, caption, plain_table(*table))


_COMPARED = "Of the head. Measured: mean of the recorded swims and their standard deviation. Ours: nothing is fitted."
_ERRORS = (
    "Root mean square over 241 times of all swims. Navier-Stokes (Aquarium.jl, two-dimensional) and Genesis as printed "
    "by the authors, whose table for Genesis comes out of the same program here. Genesis' tracks have no yaw."
)
_PIECES = "Distance of the head in 3.97 s (cm), and its error, by the commanded angles."

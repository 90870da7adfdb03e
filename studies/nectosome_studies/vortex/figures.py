"""Figures of foils that flap: lift and thrust over a beat, lift along the span."""

from typing import Any

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.view.style import BLACK, BLUE, VERMILLION, Panel, dress

from ..study import Sets

_LINES: dict[str, tuple[str, dict[str, Any]]] = {
    "foil": ("foil", {"color": BLUE, "width": 2.5}),
    "attached": ("foil without friction and stall", {"color": BLUE, "width": 1.5, "dash": "dot"}),
    "lattice": ("vortex lattice", {"color": VERMILLION, "width": 2, "dash": "dash"}),
}


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """One figure with a column for each case."""
    del runs
    shown = {name: data[name] for name in data if name != "long"}
    titles = [one.attrs["title"] for one in shown.values()]
    fig = make_subplots(
        rows=3, cols=len(shown), column_titles=titles, horizontal_spacing=0.07, vertical_spacing=0.1
    )  # fmt: skip
    for col, one in enumerate(shown.values(), start=1):
        _column(fig, col, one)
    for row, title in enumerate(("lift (N)", "thrust (N)", "lift per span (N/m)"), start=1):
        fig.update_yaxes(title=title, row=row, col=1)
    dress(fig, 860).update_layout(hovermode="closest", showlegend=True, margin_t=96, legend_y=1.035)
    return [Panel("Foils over a beat, and along their span", _CAPTION, fig)]


def _column(fig: Any, col: int, one: xr.Dataset) -> None:
    phase = one["phase"].values
    for which, (label, line) in _LINES.items():
        for row, key in ((1, "lift"), (2, "thrust")):
            y = one[key].sel(model=which).values
            first = col == 1 and row == 1
            fig.add_scatter(x=phase, y=y, name=label, line=line, mode="lines", showlegend=first, row=row, col=col)
    ends = np.stack([one["band_from"].values, one["band_to"].values], axis=1).ravel()
    foil = np.repeat(one["band_lift"].sel(model="foil").values, 2)
    shown: dict[str, Any] = {"showlegend": False, "row": 3, "col": col}
    fig.add_scatter(x=1000 * ends, y=foil, mode="lines", name="foil", line=_LINES["foil"][1], **shown)
    strips = {"x": 1000 * one["strip_at"].values, "y": one["strip_lift"].values}
    fig.add_scatter(mode="lines+markers", name="vortex lattice", line=_LINES["lattice"][1], **strips, **shown)
    if "measured_lift" in one:
        line = {"color": BLACK, "width": 1.5}
        fig.add_scatter(
            x=phase, y=one["measured_lift"].values, name="measured", line=line, mode="lines", row=1, col=col
        )
        seen = np.repeat(one["measured_band_lift"].values, 2)
        fig.add_scatter(x=1000 * ends, y=seen, mode="lines", name="measured", line=line, **shown)
    for row in (1, 2):
        fig.update_xaxes(title="share of a beat", row=row, col=col)
    fig.update_xaxes(title="along the span (mm)", row=3, col=col)


_CAPTION = (
    "Top and middle: lift and thrust over a beat. Bottom: amplitude of the lift per span, along the span; measured are "
    "the pressures of three bands. The lattice is PteraSoftware with a free wake."
)

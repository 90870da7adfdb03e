"""Figure of the silicone beam: height of its tip after each release, measured and computed."""

from typing import Any

import xarray as xr
from plotly.subplots import make_subplots

from nectosome.view.style import BLACK, BLUE, Panel, dress

from ..study import Sets

_TITLES = {
    "gravity_a": "own weight (fitted)",
    "gravity_b": "own weight, again (predicted)",
    "load_a": "52 g at the tip (predicted)",
}


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """One column for each release."""
    del runs
    return [_heights(data["beam"])]


def _heights(fit: xr.Dataset) -> Panel:
    names = [str(name) for name in fit["recording"].values]
    titles = [_TITLES[name] for name in names]
    fig = make_subplots(rows=1, cols=len(names), shared_yaxes=True, subplot_titles=titles, horizontal_spacing=0.03)
    for i, _ in enumerate(names):
        one = fit.isel(sample=fit["of"].values == i)
        here: dict[str, Any] = {"row": 1, "col": i + 1, "showlegend": i == 0}
        dots = {"color": BLACK, "size": 4}
        t, measured, computed = (one[key].values for key in ("time", "measured", "computed"))
        fig.add_scatter(x=t, y=1000 * measured, mode="markers", marker=dots, name="measured", **here)
        line = {"color": BLUE, "width": 2}
        fig.add_scatter(x=t, y=1000 * computed, mode="lines", line=line, name="computed", **here)
        fig.update_xaxes(title="time (s)", row=1, col=i + 1)
    fig.update_yaxes(title="height of the tip (mm)", row=1, col=1)
    dress(fig, 420).update_layout(hovermode="closest", showlegend=True, margin_t=70, legend_y=1.09)
    caption = (
        "Height of the tip from where it was held. Young's modulus and viscosity are of the first release; of the "
        "others only the time of the release is their own. The first 0.07 s, in which the hand lets go, are not "
        "compared."
    )
    return Panel("Release of the beam", caption, fig)

"""Figure of the catsharks: speed and Strouhal number of each swim, measured and computed."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.style import BLUE, GREEN, GREY, VERMILLION, Panel, dress

if TYPE_CHECKING:
    import xarray as xr

_READINGS = {
    "points": ("points of three swims", BLUE, "circle"),
    "full": ("as printed", VERMILLION, "square-open"),
    "half": ("twice as printed", GREEN, "diamond-open"),
}


def panels(data: Mapping[str, "xr.Dataset"]) -> list[Panel]:
    """Computed against measured, from `swims` (reading, swim); readings in metres are left to the scorecard."""
    from plotly.subplots import make_subplots

    swims = data["swims"]
    fig = make_subplots(rows=1, cols=2, horizontal_spacing=0.12)
    for k, (name, what) in enumerate((("speed", "speed (body lengths/s)"), ("strouhal", "Strouhal number")), start=1):
        measured = swims[f"measured_{name}"].values
        top = 1.1 * float(np.max(measured))
        fig.add_scatter(
            x=[0, top],
            y=[0, top],
            mode="lines",
            line={"color": GREY, "dash": "dot"},
            name="as measured",
            showlegend=k == 1,
            row=1,
            col=k,
        )
        for reading, (label, colour, symbol) in _READINGS.items():
            fig.add_scatter(
                x=measured,
                y=swims[name].sel(reading=reading).values,
                mode="markers",
                marker={"color": colour, "symbol": symbol, "size": 7},
                name=label,
                showlegend=k == 1,
                row=1,
                col=k,
            )
        fig.update_xaxes(title=f"measured {what}", rangemode="tozero", row=1, col=k)
        fig.update_yaxes(title=f"computed {what}", rangemode="tozero", row=1, col=k)
    dress(fig, 460).update_layout(hovermode="closest", showlegend=True, margin_t=64)
    caption = (
        "Computed, nothing fitted, against measured by F. Berio and others: a mark for each swim and reading of the "
        "wavelength (in body lengths). The speed that comes out hardly grows above two body lengths a second, where "
        "the sharks are reported to swim faster than their body wave."
    )
    return [Panel("Catsharks, computed and measured", caption, fig)]

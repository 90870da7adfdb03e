"""Figure of the foam limb: what its tendon was told, and how far it bends, measured and computed."""

from typing import Any

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.view.style import BLACK, BLUE, ORANGE, VERMILLION, Panel, dress

_TITLES = {
    "water_1": "water (fitted)",
    "air": "air (predicted)",
    "water_2": "water, again (predicted)",
}


def limb_panel(motions: xr.Dataset) -> Panel:
    """One column for each recording: the command above, the angle below."""
    names = [str(name) for name in motions["recording"].values]
    fig = make_subplots(
        rows=2,
        cols=len(names),
        shared_xaxes=True,
        shared_yaxes=True,
        subplot_titles=[_TITLES[name] for name in names],
        horizontal_spacing=0.03,
        vertical_spacing=0.06,
        row_heights=[0.3, 0.7],
    )
    for i, name in enumerate(names):
        one = motions.sel(recording=name)
        here: dict[str, Any] = {"col": i + 1, "showlegend": i == 0}
        t, pull = one["time"].values, 1000 * one["contraction"].values
        fig.add_scatter(
            x=t, y=pull, mode="lines", line={"color": VERMILLION, "width": 1}, name="command", row=1, **here
        )
        lines = {
            "other": ("measured, other limb", {"color": ORANGE, "width": 2}),
            "held": ("computed", {"color": BLUE, "width": 2}),
        }
        for key, (label, line) in lines.items():
            fig.add_scatter(x=t, y=np.rad2deg(one[key].values), mode="lines", line=line, name=label, row=2, **here)
        dots = {"color": BLACK, "size": 3}
        y = np.rad2deg(one["measured"].values)
        fig.add_scatter(x=t, y=y, mode="markers", marker=dots, name="measured, this limb", row=2, **here)
        fig.update_xaxes(title="time (s)", row=2, col=i + 1)
    fig.update_yaxes(title="contraction (mm)", row=1, col=1)
    fig.update_yaxes(title="angle from rest (deg)", row=2, col=1)
    dress(fig, 560).update_layout(hovermode="closest", showlegend=True, margin_t=90, legend_y=1.07)
    caption = (
        "Angle of the line through two markers of the limb, from rest. Viscosity, gain of the tendon and drag are of "
        "the first recording, with Young's modulus known. In the other two the command goes to and fro faster than the "
        "camera takes pictures: its means over frames are shown."
    )
    return Panel("The foam limb pulled by its tendon", caption, fig)

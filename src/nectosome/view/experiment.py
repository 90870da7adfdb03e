"""Figures of experiments on a rig: reference and measurement, what differs, and the command.

Data, in SI units: as the log of an experiment has it.
"""

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from .page import write_page
from .style import BLACK, BLUE, CYCLE, GREY, Panel, dress

if TYPE_CHECKING:
    import xarray as xr

_MM, _BAR = 1e3, 1e-5
_MOST = 5000  # samples that are drawn


def show_experiment(runs: "Sequence[xr.Dataset]", path: str | Path) -> None:
    """Write a page with a figure of one or several runs. Raises InputError where it cannot."""
    ended = escape(f"{runs[-1].attrs['status']}: {runs[-1].attrs['status_reason']}")
    write_page(path, str(runs[-1].attrs["title"]), [f"<p>{ended}</p>", run_panel(runs)])


def run_panel(runs: "Sequence[xr.Dataset]") -> Panel:
    """Of the last run all; of those before, their errors."""
    from plotly.subplots import make_subplots

    fig = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.05, row_heights=[0.45, 0.3, 0.25])
    several = len(runs) > 1
    for k, run in enumerate(runs):
        one = run.isel(time=slice(None, None, max(run.sizes["time"] // _MOST, 1)))
        time = one["time"].values
        measured, reference = _MM * one["measured"].values, _MM * one["reference"].values
        last = k == len(runs) - 1
        if last:
            for y, name, colour, width in ((reference, "reference", BLACK, 3.0), (measured, "measured", BLUE, 1.2)):
                line = {"color": colour, "width": width}
                fig.add_scatter(x=time, y=y, line=line, mode="lines", name=name, row=1, col=1)
            line = {"color": GREY, "width": 1.2}
            fig.add_scatter(
                x=time, y=_BAR * one["command"].values, line=line, mode="lines", name="command", row=3, col=1
            )
        line = {"color": BLUE if last else CYCLE[1 + k % (len(CYCLE) - 1)], "width": 1.0}
        name = f"error of run {k + 1}" if several else "error"
        fig.add_scatter(
            x=time, y=measured - reference, line=line, mode="lines", name=name, showlegend=several, row=2, col=1
        )
    fig.update_yaxes(title="displacement (mm)", row=1)
    fig.update_yaxes(title="error (mm)", row=2)
    fig.update_yaxes(title="command (bar)", row=3)
    fig.update_xaxes(title="time (s)", row=3)
    dress(fig, 680).update_layout(showlegend=True, hovermode="closest", margin_t=60, legend_y=1.07)
    caption = "As measured, noise included. The command acts on the rig later, by its delay." + (
        " Of runs before the last one only the error is drawn." if several else ""
    )
    return Panel("What the rig did", caption, fig)

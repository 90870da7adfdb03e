"""Figures of a soft actuator with hysteresis: loops, displacements over time, what the fit leaves.

Data: as `identify.hysteresis_results.hysteresis_data` has it.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from nectosome.identification.hysteresis.files import BENCH_UNITS

from .page import write_fit
from .style import BLACK, BLUE, Panel, dress

_MM, _BAR = 1e3, 1e-5


def show_hysteresis(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    write_fit(found, path, parameter_sentence(found), recording_panel)


def parameter_sentence(found: xr.Dataset) -> str:
    """What the displacement is not linear in, with intervals, in a sentence."""
    parts = []
    for name in found["parameter"].values:
        if not str(name).startswith("slope"):
            one = found.sel(parameter=name)
            scale, unit = BENCH_UNITS[one["unit"].item()]
            value, low, high = (f"{scale * float(one[key]):.4g}" for key in ("value", "low", "high"))
            parts.append(f"{name} {value} {unit}".strip() + f" (95 %: {low} to {high})")
    return f"{', '.join(parts)}."


def recording_panel(found: xr.Dataset, k: int) -> Panel:
    """Displacement over pressure and over time, and the error."""
    one = found.isel(sample=np.flatnonzero(found["of"].values == k), recording=k)
    specs = [[{"rowspan": 2}, {}], [None, {}]]
    fig = make_subplots(2, 2, specs=specs, column_widths=[0.4, 0.6], row_heights=[0.6, 0.4], horizontal_spacing=0.1)
    pressure, time = _BAR * one["pressure"].values, one["time"].values
    lines = {"measured": {"color": BLACK, "width": 3}, "computed": {"color": BLUE, "width": 1.5, "dash": "dash"}}
    for name, line in lines.items():
        y = _MM * one[name].values
        fig.add_scatter(x=pressure, y=y, mode="lines", line=line, name=name, row=1, col=1)
        fig.add_scatter(x=time, y=y, mode="lines", line=line, showlegend=False, row=1, col=2)
    error = _MM * (one["computed"].values - one["measured"].values)
    fig.add_scatter(x=time, y=error, mode="lines", line={"color": BLUE, "width": 1}, showlegend=False, row=2, col=2)
    fig.update_xaxes(title="pressure (bar)", row=1, col=1)
    fig.update_yaxes(title="displacement (mm)", row=1)
    fig.update_xaxes(title="time (s)", row=2, col=2)
    fig.update_yaxes(title="error (mm)", row=2, col=2)
    dress(fig, 480).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    used = "that was fitted" if one["used"].item() == "train" else "that was not fitted"
    errors = f"{float(one['e_rmsp']):.3g} % of its range in the root mean square, {float(one['e_mp']):.3g} % at most"
    name = one["recording"].item()
    return Panel(f"Displacement, {name}", f"A recording {used}, {name}: it is off by {errors}.", fig)

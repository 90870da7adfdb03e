"""Figures of a robot that was fitted to recordings: measured, computed, and residuals.

Data: as `identification.RobotFit.to_dataset` has it.
"""

from pathlib import Path

import numpy as np
import xarray as xr
from plotly.subplots import make_subplots

from .page import write_fit
from .style import BLACK, BLUE, Panel, dress

_PREFIXES = ((1e-6, "u"), (1e-3, "m"), (1.0, ""), (1e3, "k"), (1e6, "M"))
_PREFIXED = ("m", "N", "m/s", "N m", "W", "Pa")


def show_robot_fit(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure for each recording. Raises InputError where it cannot."""
    write_fit(found, path, parameter_sentence(found), recording_panel)


def parameter_sentence(found: xr.Dataset) -> str:
    """Parameters with their intervals, in a sentence."""
    parts = []
    for name in found["parameter"].values:
        one = found.sel(parameter=name)
        value, low, high = (f"{float(one[key]):.4g}" for key in ("value", "low", "high"))
        parts.append(f"{name} {value} {one['unit'].item()}".strip() + f" (95 %: {low} to {high})")
    return f"{', '.join(parts)}."


def recording_panel(found: xr.Dataset, k: int) -> Panel:
    """All columns of a recording over time, and below each by how much the computed motion is off."""
    count, one = found.sizes["column"], found.isel(recording=k)
    heights = [0.65, 0.35] * count
    fig = make_subplots(2 * count, 1, shared_xaxes=True, row_heights=heights, vertical_spacing=0.2 / (2 * count))
    lines = {"measured": {"color": BLACK, "width": 3}, "computed": {"color": BLUE, "width": 1.5, "dash": "dash"}}
    errors = []
    for c, column in enumerate(map(str, found["column"].values)):
        part = found.isel(sample=np.flatnonzero((found["of"].values == k) & (found["of_column"].values == c)))
        factor, unit = _scale(part["measured"].values, str(found["units_of"].values[c]))
        time = part["time"].values
        for name, line in lines.items():
            y = factor * part[name].values
            fig.add_scatter(x=time, y=y, mode="lines", line=line, name=name, showlegend=c == 0, row=2 * c + 1, col=1)
        error = factor * (part["computed"].values - part["measured"].values)
        line = {"color": BLUE, "width": 1}
        fig.add_scatter(x=time, y=error, mode="lines", line=line, showlegend=False, row=2 * c + 2, col=1)
        fig.update_yaxes(title=f"{column} ({unit})" if unit else column, row=2 * c + 1)
        fig.update_yaxes(title=f"error ({unit})" if unit else "error", row=2 * c + 2)
        off = (f"{float(one[key][c]):.3g} %" for key in ("e_rmsp", "e_mp"))
        errors.append(f"{column} is off by {next(off)} of its range in the root mean square, {next(off)} at most")
    fig.update_xaxes(title="time (s)", row=2 * count)
    dress(fig, 120 + 300 * count).update_layout(showlegend=True, hovermode="closest", margin_t=50)
    used = "that was fitted" if one["used"].item() == "train" else "that was not fitted"
    name = one["recording"].item()
    return Panel(f"Recording {name}", f"A recording {used}, {name}: {'; '.join(errors)}.", fig)


def _scale(values: np.ndarray, unit: str) -> tuple[float, str]:
    """Factor and unit in which values are easy to read."""
    if unit == "rad":
        return 180 / np.pi, "deg"
    largest = float(np.nanmax(np.abs(values), initial=0.0))
    if unit not in _PREFIXED or largest == 0:
        return 1.0, unit
    size, prefix = next(((s, p) for s, p in reversed(_PREFIXES) if largest >= s), _PREFIXES[0])
    return 1 / size, prefix + unit

"""The page of means by conditions: values with their 95 % intervals, beside what was simulated."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from nectosome.measure.condition_means import NUMBERS
from nectosome.measure.labels import unit_of
from nectosome.units import InputError, dimension_of, show_quantity

from .page import write_page
from .style import CYCLE, Panel, dress, easy_unit, readable, titled

_DASHES = ("solid", "dash", "dot", "dashdot")
_MARKS = ("circle", "square", "diamond", "triangle-up", "x", "cross")


def show_means(found: xr.Dataset, path: str | Path) -> None:
    """Write a page about a table by `condition_means`. Raises InputError for others, and where it cannot be written."""
    if "condition" not in found.dims or "mean" not in found:
        raise InputError("this dataset has no means by conditions.")
    write_page(path, str(found.attrs["title"]), means_panels(found).values())


def means_panels(found: xr.Dataset) -> dict[str, Panel]:
    """A panel for each number, by its name."""
    return {name: _panel(found, name) for name in NUMBERS if name in found}


def _panel(found: xr.Dataset, name: str) -> Panel:
    """A number over the condition that has most values, a curve for each set of the others."""
    names = str(found.attrs["conditions"]).splitlines()
    along = max(names, key=lambda one: len(np.unique(found[one].values)), default=None)
    x = np.arange(found.sizes["condition"]) + 1.0 if along is None else found[along].values
    x_unit = "1" if along is None else str(found[along].attrs["units"])
    ends = np.stack([found[f"{name}_{end}"].values for end in ("low", "high")])
    scale, unit = easy_unit(ends, str(found[name].attrs["units"]))
    x_scale, x_easy = easy_unit(x, x_unit)
    fig = go.Figure()
    for k, (label, rows) in enumerate(_curves(found, [one for one in names if one != along]).items()):
        rows = rows[np.argsort(x[rows])]
        value, low, high = (scale * y[rows] for y in (found[name].values, *ends))
        colour = CYCLE[k % len(CYCLE)]
        fig.add_scatter(
            x=x_scale * x[rows],
            y=value,
            error_y={"type": "data", "symmetric": False, "array": high - value, "arrayminus": value - low, "width": 5},
            mode="markers",
            marker={"color": colour, "size": 8, "symbol": _MARKS[k % len(_MARKS)]},
            name=label or "measured",
        )
        if name == "mean" and "simulated" in found:
            line = {"color": colour, "dash": _DASHES[k % len(_DASHES)], "width": 1.5}
            y = scale * found["simulated"].values[rows]
            fig.add_scatter(x=x_scale * x[rows], y=y, mode="lines", line=line, name=f"{label} simulated".strip())
    fig.update_xaxes(title="row" if along is None else titled(along, x_easy))
    fig.update_yaxes(title=titled(readable(name), unit))
    dress(fig, 420).update_layout(showlegend=True, hovermode="closest")
    runs = int(found["runs"].sum())
    beside = " Lines: simulated at the same conditions, joined." if name == "mean" and "simulated" in found else ""
    pooled = (
        "scatter of repeats or of cycles, whichever is larger" if found["runs"].max() > 1 else "scatter of cycles alone"
    )
    return Panel(_title(found, name), f"{runs} recordings; bars are 95 % intervals, by the {pooled}.{beside}", fig)


def _title(found: xr.Dataset, name: str) -> str:
    column, against = str(found.attrs["column"]), str(found.attrs["against"])
    if name == "phase":
        return f"Phase of {column} ahead of {against}"
    if name in ("loop_area", "power"):
        return f"{readable(name).capitalize()} of {column} over {against}"
    return f"{readable(name).capitalize()} of {column}"


def _curves(found: xr.Dataset, names: list[str]) -> dict[str, np.ndarray]:
    """Rows of each set of the other conditions, by its words."""
    out: dict[str, list[int]] = {}
    for k in range(found.sizes["condition"]):
        words = (f"{n} {show_quantity(float(found[n][k]), dimension_of(unit_of(found[n])))}" for n in names)
        out.setdefault(", ".join(words), []).append(k)
    return {label: np.array(rows) for label, rows in out.items()}

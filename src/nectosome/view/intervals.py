"""The page of intervals: how wide each number is, what makes it wide, and bands of the motion over time."""

from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr

from nectosome.designs.prediction_intervals import HIGH, LOW, Draws
from nectosome.io.results import dataset_of
from nectosome.io.tables import number
from nectosome.units import InputError

from .page import write_page
from .still import html_table
from .style import BLUE, GREEN, ORANGE, Panel, dress

_BAND = 0.2  # opacity
_ROW = 22  # px of a bar
_WIDEST = 200.0  # percent that bars show; the table has all
_RANKED = 12  # sources in the figure


def show_intervals(found: Draws | xr.Dataset, path: str | Path) -> None:
    """Write a page about the draws of `--spread`. Raises InputError for others, and where it cannot be written."""
    found = dataset_of(found)
    if "place" not in found or "low" not in found:
        raise InputError("this dataset has no draws: it lacks the places of their sources.")
    panels = [*_bars(found), *_ranking(found), *bands(found)]
    write_page(path, str(found.attrs["title"]), [*panels, _table(found)])


def _bars(found: xr.Dataset) -> list[Panel]:
    """A bar for each number that is not 0 in the file's robot, in percent of it."""
    value, low, high = (found[name].values for name in ("value", "low", "high"))
    shown = [k for k in range(found.sizes["number"]) if value[0, k] and np.isfinite(value[0, k]) and low[k] < high[k]]
    if not shown:
        return []
    fig = go.Figure()
    names = [str(found["number"].values[k]) for k in shown]
    ranges = np.array([sorted(100 * (x / value[0, k] - 1) for x in (low[k], high[k])) for k in shown])
    cut = np.clip(ranges, -_WIDEST, _WIDEST)
    fig.add_bar(y=names, x=cut[:, 1] - cut[:, 0], base=cut[:, 0], orientation="h", marker={"color": BLUE})
    fig.update_xaxes(title="80 % interval about the value of the file (%)")
    fig.update_yaxes(autorange="reversed", automargin=True)
    dress(fig, 110 + _ROW * len(shown)).update_layout(hovermode="closest")
    beyond = " Bars that leave the scale go on: see the table." if (cut != ranges).any() else ""
    ends = f"{100 * LOW:.0f} % and {100 * HIGH:.0f} %"
    wide = "with what models of the water leave out"
    told = "".join(f" Warning: {words}." for words in found.attrs.get("cautions", "").splitlines())
    caption = f"Between the {ends} quantiles of the draws, {wide}; 0 is the robot of the file.{beyond}{told}"
    return [Panel("How far numbers may be off", caption, fig)]


def _ranking(found: xr.Dataset) -> list[Panel]:
    """Mean share of each source in the variance of all numbers."""
    shares = found["share"].values
    known = np.isfinite(shares).all(axis=0)
    if not known.any():
        return []
    means = 100 * shares[:, known].mean(axis=1)
    order = np.argsort(-means)[:_RANKED]
    fig = go.Figure()
    names = [str(found["source"].values[k]) for k in order]
    fig.add_bar(y=names, x=means[order], orientation="h", marker={"color": ORANGE})
    fig.update_xaxes(title="share of the variance, mean over all numbers (%)")
    fig.update_yaxes(autorange="reversed", automargin=True)
    dress(fig, 110 + _ROW * len(order)).update_layout(hovermode="closest")
    caption = (
        "What is not known exactly, by how much of the widths it makes; of a linear fit by its places in the draws."
    )
    return [Panel("What makes them wide", caption, fig)]


def bands(found: xr.Dataset) -> list[Panel]:
    """Velocity of the body over time, where it moves."""
    fig = velocity_bands(found)
    if fig is None:
        return []
    caption = (
        "Velocity of the body in the world: the robot of the file, and the band that holds four fifths of the draws."
    )
    return [Panel("Velocity of the body", caption, dress(fig, 380).update_layout(showlegend=True))]


def velocity_bands(found: xr.Dataset) -> go.Figure | None:
    """Velocity of the body: the band between the quantiles, and the robot of the file; None where it stands."""
    if "time" not in found.dims or "velocity_x" not in found:
        return None
    fig = go.Figure()
    for axis, colour, dash in zip("xyz", (BLUE, ORANGE, GREEN), ("solid", "dash", "dot"), strict=True):
        values = found[f"velocity_{axis}"].values
        if not np.nanmax(np.abs(values), initial=0.0) > 0:
            continue
        known = np.isfinite(values[1:]).any(axis=0)
        low, high = np.nanquantile(values[1:, known], [LOW, HIGH], axis=0)
        add_band(fig, found["time"].values[known], low, high, colour)
        line = {"color": colour, "dash": dash}
        fig.add_scatter(x=found["time"].values, y=values[0], name=f"along {axis}", line=line)
    fig.update_xaxes(title="time (s)")
    fig.update_yaxes(title="velocity (m/s)")
    return fig if fig.data else None


def add_band(fig: go.Figure, x: np.ndarray, low: np.ndarray, high: np.ndarray, colour: str) -> None:
    """Fill the band between two curves."""
    hidden = {"mode": "lines", "line": {"width": 0, "color": colour}, "showlegend": False, "hoverinfo": "skip"}
    fig.add_scatter(x=x, y=low, **hidden)
    red, green, blue = (int(colour[k : k + 2], 16) for k in (1, 3, 5))
    fig.add_scatter(x=x, y=high, fill="tonexty", fillcolor=f"rgba({red},{green},{blue},{_BAND})", **hidden)


def _table(found: xr.Dataset) -> str:
    """Every number with its interval."""
    heads = ("number", "value", f"{100 * LOW:.0f} %", f"{100 * HIGH:.0f} %", "unit")
    rows = [
        (str(name), *map(number, (value, low, high)), str(unit).removesuffix("1") if unit == "1" else str(unit))
        for name, value, low, high, unit in zip(
            found["number"].values,
            found["value"].values[0],
            found["low"].values,
            found["high"].values,
            found["unit"].values,
            strict=True,
        )
    ]
    return html_table([heads, *rows])

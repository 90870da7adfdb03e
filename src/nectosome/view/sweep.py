"""Figures of a sweep: what a robot's motion gives over one or two of its quantities."""

from pathlib import Path

import plotly.graph_objects as go
import xarray as xr

from nectosome.designs.sweep import MEANS, intervals_of, mean_of, nonzero_means, of_file
from nectosome.io.results import dataset_of
from nectosome.units import InputError, shown_unit

from .heatmap import MapAxis, maps, sequential
from .intervals import add_band
from .page import write_page
from .style import BLUE, Panel, dress, readable, titled

_CAPTIONS = {
    "speed": "Mean speed of the body through the water.",
    "speed_over_ground": "Mean speed of the body with that of the current.",
    "forward_speed": "Along the robot's own forward axis: negative where it swims tail first.",
    "force": "What pushes the robot along the world's {}, and what holds it has to hold.",
    "power": "What all drives give.",
    "body_lengths_per_second": "Forward speed over the body's length.",
    "tail_amplitude": "Half the way of the robot's rearmost end from side to side.",
    "strouhal": "Beats per second times the tail's way from side to side, over the speed.",
    "slip": "Forward speed over that of the wave along the body.",
    "efficiency": "Quasi-propulsive: power that tows the body on its way, over the power of all drives.",
    "froude_efficiency": "Mean thrust times speed over the power of all drives.",
    "cost_of_transport": "Power over weight in air and speed.",
    "energy_per_metre": "Energy that all drives give, over the way.",
    "cost_of_transport_battery": "Power that batteries give, to the electronics too, over weight in air and speed.",
    "endurance": "Time until the first battery is empty.",
    "range": "Way until the first battery is empty.",
    "turn_rate": "How fast the body's heading turns.",
}


def show_sweep(found: xr.Dataset, path: str | Path) -> None:
    """Write a page with a figure of each mean of a sweep over one or two axes. Raises InputError where it cannot."""
    found = dataset_of(found)
    if lacking := [name for name in MEANS if name not in found]:
        raise InputError(f"this dataset is no sweep: it lacks {lacking[0]}.")
    write_page(path, str(found.attrs["title"]), panels(found))


def panels(found: xr.Dataset) -> list[Panel]:
    """A map over two axes, or a curve over one, of each mean that is there."""
    out = []
    band = " The band is the 80 % interval." if "draw" in found.dims else ""
    for name, values in nonzero_means(found).items():
        kind, _, axis = name.partition(".")
        caption = f"Mean over a cycle. {_CAPTIONS[kind].format(axis)}{band}"
        title = readable(str(values.name))
        out.append(Panel(title[:1].upper() + title[1:], caption, sweep_figure(found, name)))
    return out


def sweep_figure(found: xr.Dataset, name: str) -> go.Figure:
    """A map over two axes, or a curve over one, of a mean that is known somewhere."""
    values = mean_of(found, name)
    if "draw" not in found.dims:
        return _curve(found, values) if values.ndim == 1 else _map(found, values)
    values = values.assign_attrs(units=nonzero_means(found)[name].attrs["units"])
    value, low, high = intervals_of(found, values)
    if value.ndim == 2:
        return _map(of_file(found), value)
    fig = _curve(of_file(found), value)
    add_band(fig, axis_of(found[value.dims[0]]).values, low.values, high.values, BLUE)
    return fig


def sides(found: xr.Dataset) -> tuple[str, ...]:
    """Names of the axes as a figure has them: to the right, then up. The one with more values goes to the right."""
    return tuple(sorted(map(str, found["status"].dims), key=lambda name: found.sizes[name]))[::-1]


def axis_of(values: xr.DataArray) -> MapAxis:
    """Values of an axis of the grid, in the unit that people read; choices as they are."""
    if values.dtype.kind == "U":
        return MapAxis(values.values, titled(values.name, ""))
    factor, unit = shown_unit(str(values.attrs.get("units", "")))
    return MapAxis(factor * values.values, titled(values.name, unit))


def _map(found: xr.Dataset, values: xr.DataArray) -> go.Figure:
    """Colours over both axes."""
    across, down = sides(found)
    x, y = (axis_of(found[name]) for name in (across, down))
    z = values.transpose(down, across).values
    return maps(x, y, {"": z}, sequential(z, str(values.attrs["units"])))


def _curve(found: xr.Dataset, values: xr.DataArray) -> go.Figure:
    """One line over the only axis."""
    x = axis_of(found[values.dims[0]])
    fig = go.Figure()
    fig.add_scatter(x=x.values, y=values.values, mode="lines+markers", line={"color": BLUE})
    fig.update_xaxes(title=x.title)
    fig.update_yaxes(title=f"{readable(str(values.name))} ({values.attrs['units']})")
    return dress(fig, 380)

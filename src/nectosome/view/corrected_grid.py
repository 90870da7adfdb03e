"""Figures of a correction: the grid as simulated and as corrected, and how well experiments are predicted.

They take what `identification.corrected_data` gives.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float

from nectosome.identification.fits.errors import SIDES
from nectosome.units import dimension_of, show_quantity, shown_unit

from .heatmap import STAR, MapAxis, diverging, maps, sequential
from .page import write_page
from .style import BLACK, BLUE, GREY, VERMILLION, Panel, dress, plain, span

_BOTH = 0.1  # values count as both positive and negative where the shorter side is more than that share of the longer


def show_correction(found: xr.Dataset, path: str | Path, aim: str = "highest") -> None:
    """Write a page with the figures of a correction. Raises InputError where it cannot."""
    write_page(path, str(found.attrs["title"]), panels(found, aim))


def panels(found: xr.Dataset, aim: str = "highest") -> list[Panel]:
    """Maps of two conditions or curves of one; predictions of the experiments in any case."""
    conditions = found["simulated"].ndim
    shown = [curves_panel(found, aim)] if conditions == 1 else map_panels(found, aim) if conditions == 2 else []
    return [*shown, predictions_panel(found)]


def map_panels(found: xr.Dataset, aim: str) -> list[Panel]:
    """The grid as simulated and corrected, what is not known of it, and the parameter."""
    name, called = str(found.attrs["quantity"]), str(found.attrs["parameter"])
    caption = (
        f"{name}, as simulated and as corrected by {found.attrs['method']}. Dots: measured; diamonds: the next "
        f"experiments; star: the {_best(aim)}."
    )
    out = [Panel("Corrected grid", caption, grid_maps(found, aim, "simulated", "corrected"))]
    half, parameter = unknown_map(found), parameter_map(found)
    if half is not None:
        what = "Half of the 95 % interval of the corrected value, without the noise of a measurement."
        out.append(Panel("What is not known", what, half))
    if parameter is not None:
        unit = str(found["parameter"].attrs.get("units", "1"))
        took = show_quantity(float(found.attrs["nominal"]), dimension_of(unit))
        what = f"{called} as the experiments tell it; the simulator took {took}."
        out.append(Panel("The simulator's parameter", what, parameter))
    return out


def grid_maps(found: xr.Dataset, aim: str, *names: str) -> go.Figure:
    """Maps of the grid, "simulated" or "corrected", in the same colours, with the experiments and the best point."""
    name = str(found.attrs["quantity"])
    shown = {"simulated": found["simulated"], "corrected": found[name]}
    both = np.stack([values.values for values in shown.values()])
    sides = np.abs([both.min(), both.max()])
    axis = diverging if both.min() < 0 < both.max() and sides.min() > _BOTH * sides.max() else sequential
    return _maps(found, {title: shown[title] for title in names}, axis(both, _unit(found[name])), _best(aim))


def unknown_map(found: xr.Dataset) -> go.Figure | None:
    """Half of the 95 % interval of the corrected values; None where the method tells none."""
    name = str(found.attrs["quantity"])
    half = SIDES * found[f"{name}_error"]
    if not half.notnull().all():
        return None
    return _maps(found, {"half of the 95 % interval": half}, sequential(half.values, _unit(found[name])))


def parameter_map(found: xr.Dataset) -> go.Figure | None:
    """The simulator's parameter as the experiments tell it; None where they do not."""
    estimate, name = found["parameter"], str(found.attrs["parameter"])
    if not estimate.notnull().all():
        return None
    unit = _unit(estimate) if estimate.attrs["units"] else name
    return _maps(found, {name: estimate}, sequential(estimate.values, unit))


def _best(aim: str) -> str:
    return "lowest" if aim == "lowest" else "highest"


def _maps(
    found: xr.Dataset, shown: dict[str, xr.DataArray], colours: dict[str, Any], best: str | None = None
) -> go.Figure:
    """Maps with the experiments on them; the condition with more levels goes to the right."""
    down, across = sorted(found["simulated"].dims, key=lambda name: found.sizes[name])
    values = {plain(title): x.transpose(down, across) for title, x in shown.items()}
    x, y = (MapAxis(_scaled(found[name]), _title(found[name])) for name in (across, down))
    fig = maps(x, y, {title: z.values for title, z in values.items()}, colours)
    for col, z in enumerate(values.values(), start=1):
        for kind, symbol, colour, size, line in (
            ("measured", "circle", BLACK, 7, {"color": "white", "width": 1}),
            ("next", "diamond-open", VERMILLION, 12, {"color": VERMILLION, "width": 2.5}),
        ):
            at = [_scaled(found[f"{kind}_{name}"]) for name in (across, down)]
            _points(fig, at, kind, {"symbol": symbol, "color": colour, "size": size, "line": line}, col)
        if best is not None:
            there = z.isel(z.argmin(...) if best == "lowest" else z.argmax(...))
            _points(fig, [np.atleast_1d(_scaled(there[name])) for name in (across, down)], best, STAR, col)
    return fig


def _points(fig: go.Figure, at: Sequence[np.ndarray], name: str, marker: dict[str, Any], col: int) -> None:
    style = {"mode": "markers", "marker": marker, "name": name, "showlegend": col == 1, "cliponaxis": False}
    hover = f"{name}: %{{x:.4g}}, %{{y:.4g}}<extra></extra>"
    fig.add_scatter(x=at[0], y=at[1], hovertemplate=hover, row=1, col=col, **style)


def curves_panel(found: xr.Dataset, aim: str) -> Panel:
    """Simulated and corrected curves over the only condition, with a 95 % band."""
    name, (condition,) = str(found.attrs["quantity"]), found["simulated"].dims
    x, y, error = _scaled(found[condition]), found[name].values, SIDES * found[f"{name}_error"].values
    fig = go.Figure()
    if np.isfinite(error).all():
        band = {"x": np.concatenate([x, x[::-1]]), "y": np.concatenate([y + error, (y - error)[::-1]])}
        fill = {"fill": "toself", "fillcolor": "rgba(0,114,178,0.2)", "line_width": 0, "hoverinfo": "skip"}
        fig.add_scatter(**band, **fill, mode="lines", name="95 %")
    dashed = {"color": GREY, "dash": "dash"}
    fig.add_scatter(x=x, y=found["simulated"].values, mode="lines", name="simulated", line=dashed)
    fig.add_scatter(x=x, y=y, mode="lines", name="corrected", line={"color": BLUE})
    marks = (("measured", "measured", "circle", BLACK), ("next", "expected", "diamond-open", VERMILLION))
    for kind, value, symbol, colour in marks:
        bars = {"array": SIDES * found[f"{value}_error"].values, "thickness": 1, "width": 3}
        marker = {"symbol": symbol, "color": colour, "size": 7 if kind == "measured" else 12}
        style = {"mode": "markers", "marker": marker, "error_y": bars if kind == "measured" else None}
        fig.add_scatter(x=_scaled(found[f"{kind}_{condition}"]), y=found[value].values, name=kind, **style)
    k = int(np.argmin(y) if aim == "lowest" else np.argmax(y))
    fig.add_scatter(x=x[[k]], y=y[[k]], mode="markers", marker=STAR, name=_best(aim))
    fig.update_xaxes(title=_title(found[condition]))
    fig.update_yaxes(title=f"{plain(name)} ({_unit(found[name])})")
    dress(fig, 460).update_layout(showlegend=True, hovermode="closest", margin_t=60)
    caption = (
        f"{name} as simulated and as corrected by {found.attrs['method']}, with 95 % intervals of the curve and of "
        "what was measured. Diamonds: the next experiments."
    )
    return Panel("Corrected curve", caption, fig)


def predictions_panel(found: xr.Dataset) -> Panel:
    """Measured values against what the others tell of them, and against the simulator."""
    measured, predicted = found["measured"].values, found["predicted"].values
    unit, fig = _unit(found["measured"]), go.Figure()
    ends = span([*measured, *predicted, *found["simulated_there"].values])
    fig.add_scatter(x=ends, y=ends, mode="lines", line={"color": GREY, "dash": "dot"}, name="as measured")
    grey = {"symbol": "circle-open", "color": GREY, "size": 9}
    own = found["simulated_there"].values
    fig.add_scatter(x=own, y=measured, mode="markers", marker=grey, name="simulator as it was")
    bars = {
        f"error_{axis}": {"array": SIDES * np.nan_to_num(found[f"{kind}_error"].values), "thickness": 1, "width": 3}
        for axis, kind in (("x", "predicted"), ("y", "measured"))
    }
    marker = {"color": BLUE, "size": 8}
    fig.add_scatter(x=predicted, y=measured, mode="markers", marker=marker, name="corrected, by the others", **bars)
    fig.update_xaxes(title=f"predicted ({unit})", range=ends)
    fig.update_yaxes(title=f"measured ({unit})", range=ends)
    dress(fig, 560).update_layout(showlegend=True, hovermode="closest", margin_t=60)
    caption = (
        "Each experiment against what the correction by all others predicts of it (leave-one-out), with 95 % "
        "intervals, and against the simulator as it was."
    )
    return Panel("Predicted and measured", caption, fig)


def _scaled(x: xr.DataArray) -> Float[np.ndarray, "..."]:
    return shown_unit(str(x.attrs.get("units", "")))[0] * x.values


def _unit(x: xr.DataArray) -> str:
    return plain(shown_unit(str(x.attrs.get("units", "")))[1] or "1")


def _title(x: xr.DataArray) -> str:
    return f"{plain(x.name)} ({_unit(x)})"

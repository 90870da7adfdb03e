"""Figures of the landscape of a search: speed and torque around designs, sensitivities, trends of best stiffness."""

from collections.abc import Callable
from typing import Any

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.view.heatmap import add_key, add_level, diverging, edges
from nectosome.view.style import BLACK, BLUE, GREEN, VERMILLION, Panel, dress, plain

from .axes import log_ticks

NAMES = {
    "L": "length",
    "tip_radius": "tip radius",
    "alpha": "hook angle",
    "omega": "motor speed",
    "E": "Young's modulus",
}
_UNITS = {"alpha": (180 / np.pi, "deg"), "tip_radius": (1e3, "mm")}
_UNSOLVED = "#b9bec5"
_ABREAST = 3


def map_panel(chart: xr.Dataset) -> Panel:
    """Speed of each design against motor speed and Young's modulus, with the torque limit."""
    caption = (
        "Computed steady speed against motor speed and Young's modulus, all else as in the design: blue swims forward, "
        "orange backward, and on the dotted line the thrust reverses. "
    )
    fig = _charts(chart, _by_design(chart["speed"]), lambda z: diverging(z, "m/s"))
    return Panel("Forward and backward: motor speed and stiffness", caption + _lines_said(chart), fig)


def torque_panel(chart: xr.Dataset) -> Panel:
    """Motor torque of each design against motor speed and Young's modulus, with its limit."""
    torque = _by_design(chart["torque"])
    fig = _charts(chart, np.log10(np.where(torque > 0, torque, np.nan)), _torque_colours)
    caption = "Computed motor torque of the same steady motions, on a logarithmic scale of colours. "
    return Panel("What the motor must give", caption + _lines_said(chart), fig)


def _by_design(values: xr.DataArray) -> Float[np.ndarray, "design young omega"]:
    return values.transpose("design", "young", "omega").values


def _lines_said(chart: xr.Dataset) -> str:
    """What the captions of both maps say about lines and empty cells."""
    said = "The solid line is where the motor's torque reaches its limit. " if "torque_limit" in chart.attrs else ""
    if np.any(~np.isfinite(chart["speed"].values)):
        said += "Grey: no steady motion was found. "
    return said.strip()


def _torque_colours(exponents: Float[np.ndarray, "design young omega"]) -> dict[str, object]:
    """Colour axis of torques given by their exponents of ten."""
    seen = exponents[np.isfinite(exponents)]
    low, high = (float(seen.min()), float(seen.max())) if seen.size else (-1.0, 0.0)
    ticks = [t for t in (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0) if low <= np.log10(t) <= high]
    bar = {"title": "N m", "tickvals": np.log10(ticks).tolist(), "ticktext": [f"{t:g}" for t in ticks], "len": 0.8}
    return {"colorscale": "Cividis", "cmin": low, "cmax": high, "colorbar": bar}


def _charts(
    chart: xr.Dataset,
    shown: Float[np.ndarray, "design young omega"],
    colours: Callable[[np.ndarray], dict[str, object]],
) -> go.Figure:
    """Heat maps of `shown`, one a design, with the lines of no speed and of the torque limit."""
    names = [plain(name) for name in chart["design"].values]
    rows, cols = -(-len(names) // _ABREAST), min(len(names), _ABREAST)
    spacing: Any = {"horizontal_spacing": 0.03, "vertical_spacing": 0.12 / rows}
    fig = make_subplots(rows, cols, shared_xaxes=True, shared_yaxes=True, subplot_titles=names, **spacing)
    speed, torque = _by_design(chart["speed"]), _by_design(chart["torque"])
    omega, young = chart["omega"].values, 1e-6 * chart["young"].values
    limit = chart.attrs.get("torque_limit")
    hover = (
        "%{customdata[0]:.4g} rad/s, %{customdata[1]:.4g} MPa<br>%{customdata[3]:.4f} m/s at %{customdata[2]:.3f} N m"
    )
    star: Any = {
        "mode": "markers",
        "marker": {"symbol": "star", "size": 15, "color": "white", "line": {"color": BLACK, "width": 1.5}},
        "cliponaxis": False,
        "name": "the design's own motor speed and modulus",
        "hovertemplate": "%{x:.4g} rad/s, %{y:.4g} MPa",
    }
    for i, name in enumerate(names):
        where: Any = {"row": i // _ABREAST + 1, "col": i % _ABREAST + 1}
        hovered = np.stack([*np.meshgrid(omega, young), torque[i], speed[i]], axis=-1)
        x, y = edges(omega), np.exp(edges(np.log(young)))
        cells: Any = {"z": shown[i], "customdata": hovered, "coloraxis": "coloraxis"}
        fig.add_heatmap(x=x, y=y, name=name, hovertemplate=hover, **cells, **where)
        if min(speed[i].shape) > 1:
            add_level(fig, omega, young, speed[i], 0.0, "dot", where)
            if limit is not None:
                add_level(fig, omega, young, torque[i], limit, "solid", where)
        if "here_omega" in chart and "here_young" in chart:
            here = {"x": [float(chart["here_omega"][i])], "y": [1e-6 * float(chart["here_young"][i])]}
            fig.add_scatter(**here, showlegend=i == 0, **star, **where)
    add_key(fig, "speed 0", "dot")
    if limit is not None:
        add_key(fig, f"torque {limit:g} N m", "solid")
    for col in range(1, cols + 1):
        lowest = rows - (col > (len(names) - 1) % _ABREAST + 1)
        fig.update_xaxes(title="motor speed (rad/s)", showticklabels=True, row=lowest, col=col)
    fig.update_yaxes(type="log", **log_ticks(young))
    fig.update_yaxes(title="Young's modulus (MPa)", col=1)
    dress(fig, 130 + 300 * rows)
    fig.update_layout(showlegend=True, hovermode="closest", margin_t=76, plot_bgcolor=_UNSOLVED)
    fig.update_layout(legend_yref="container", legend_y=1.0, legend_yanchor="top", coloraxis=colours(shown))
    fig.update_xaxes(showgrid=False, zeroline=False, range=edges(omega)[[0, -1]].tolist())
    fig.update_yaxes(showgrid=False, zeroline=False, range=(edges(np.log10(young))[[0, -1]]).tolist())
    return fig


def sensitivity_panel(sensitivity: xr.Dataset) -> Panel:
    """Change of speed and torque for one percent more of each variable, the strongest on top."""
    outputs = [plain(name) for name in sensitivity["output"].values]
    fig = make_subplots(1, len(outputs), shared_yaxes=True, horizontal_spacing=0.06, subplot_titles=outputs)
    percent = sensitivity["percent"].transpose("variable", "output").values
    order = np.argsort(np.nan_to_num(np.abs(percent[:, 0]), nan=-1.0), kind="stable")
    names = [plain(NAMES.get(str(v), str(v).replace("_", " "))) for v in sensitivity["variable"].values[order]]
    most = float(np.max(np.abs(percent[np.isfinite(percent)]), initial=0.0)) or 1.0
    for col, (output, change) in enumerate(zip(outputs, percent[order].T, strict=True), start=1):
        bars = {
            "marker_color": [BLUE if c > 0 else VERMILLION for c in change],
            "text": [f"{c:+.2f} %" if abs(c) >= 0.1 else f"{c:+.1g} %" if np.isfinite(c) else "" for c in change],
            "textposition": "outside",
            "cliponaxis": False,
            "hovertemplate": "%{y}: %{x:+.4f} %",
        }
        fig.add_bar(x=change, y=names, orientation="h", name=output, row=1, col=col, **bars)
    fig.update_xaxes(title="change (%)", range=(-1.5 * most, 1.5 * most))
    dress(fig, 130 + 46 * len(names)).update_layout(hovermode="closest", margin_l=130, margin_t=60)
    fig.update_yaxes(showgrid=False)
    fig.update_xaxes(zerolinecolor=BLACK)
    label = sensitivity.attrs.get("label")
    caption = (
        "Computed: percent by which an output of the steady motion changes for one percent more of a variable, from "
        "derivatives at this design. Blue: more; orange: less."
    )
    return Panel(f"Sensitivity{f' of {label}' if label else ''}", caption, fig)


def trend_panel(trend: xr.Dataset) -> Panel:
    """Best Young's modulus, and the speed with it, where the hook angle or the tip radius is given."""
    fixed = [str(name) for name in trend["fixed"].values]
    spacing: Any = {"horizontal_spacing": 0.05, "vertical_spacing": 0.06, "row_heights": [0.62, 0.38]}
    fig = make_subplots(2, len(fixed), shared_xaxes=True, shared_yaxes=True, **spacing)
    for col, name in enumerate(fixed, start=1):
        own = trend.isel(fixed=col - 1).sortby("value")
        scale, unit = _UNITS.get(name, (1.0, "SI"))
        curves = ((1e-6 * own["young"].values, BLUE, "MPa"), (own["speed"].values, GREEN, "m/s"))
        for row, (y, colour, of) in enumerate(curves, start=1):
            style = {"mode": "lines+markers", "line_color": colour, "marker_size": 8, "name": name}
            hover = f"%{{x:.4g}} {unit}: %{{y:.4g}} {of}"
            fig.add_scatter(x=scale * own["value"].values, y=y, hovertemplate=hover, row=row, col=col, **style)
        fig.update_xaxes(title=f"{plain(NAMES.get(name, name))} ({unit})", row=2, col=col)
    fig.update_yaxes(type="log", row=1, **log_ticks(1e-6 * trend["young"].values.ravel()))
    fig.update_yaxes(title="best Young's modulus (MPa)", row=1, col=1)
    fig.update_yaxes(title="speed (m/s)", row=2, col=1)
    dress(fig, 480).update_layout(hovermode="closest")
    caption = (
        "Computed: Young's modulus of the best design (above) and its speed (below) where one variable is given and "
        "all others are optimised; no point where the search found none."
    )
    return Panel("How the best stiffness moves", caption, fig)

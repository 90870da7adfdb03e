"""Heat maps: cells of colour over two quantities, with lines on which something has a level."""

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float
from plotly.subplots import make_subplots

from .style import BLACK, BLUE, VERMILLION, dress

_MINUS_PLUS = [
    (0.0, "#7a3300"),
    (0.2, VERMILLION),
    (0.4, "#f6c9a6"),
    (0.5, "#ffffff"),
    (0.6, "#a9d3ee"),
    (0.8, BLUE),
    (1.0, "#00304f"),
]


def diverging(values: Float[np.ndarray, "..."], unit: str) -> dict[str, Any]:
    """Colour axis that is white at zero, as far to both sides."""
    most = float(np.max(np.abs(values[np.isfinite(values)]), initial=0.0)) or 1.0
    return {"colorscale": _MINUS_PLUS, "cmin": -most, "cmax": most, "colorbar": _bar(unit)}


def sequential(values: Float[np.ndarray, "..."], unit: str) -> dict[str, Any]:
    """Colour axis from the smallest to the largest value."""
    return {"colorscale": "Cividis", "cmin": np.nanmin(values), "cmax": np.nanmax(values), "colorbar": _bar(unit)}


def _bar(unit: str) -> dict[str, Any]:
    return {"title": {"text": unit, "side": "top"}, "thickness": 14, "outlinewidth": 0, "x": 1.01}


STAR = {"symbol": "star", "size": 16, "color": "white", "line": {"color": BLACK, "width": 1.5}}  # marks the best


class MapAxis(NamedTuple):
    """Values along an axis of maps, and what they are, with their unit."""

    values: Float[np.ndarray, "n"]
    title: str


class LevelLine(NamedTuple):
    """Where a quantity has a level, drawn over maps."""

    values: Float[np.ndarray, "ny nx"]
    level: float
    text: str
    dash: str = "dot"


def maps(
    x: MapAxis,
    y: MapAxis,
    shown: Mapping[str, Float[np.ndarray, "ny nx"]],
    colours: dict[str, Any],
    lines: Sequence[LevelLine] = (),
    best: bool = False,
) -> go.Figure:
    """Maps side by side, by title, that share their axes and colours; `best` marks the largest value of each."""
    fig = make_subplots(1, len(shown), shared_yaxes=True, horizontal_spacing=0.03, subplot_titles=list(shown))
    unit = colours["colorbar"]["title"]["text"]
    for col, (title, z) in enumerate(shown.items(), start=1):
        where: Any = {"row": 1, "col": col}
        hover = f"{x.title} %{{x:.4g}}, {y.title} %{{y:.4g}}<br>%{{z:.4g}} {unit}"
        fig.add_heatmap(x=x.values, y=y.values, z=z, coloraxis="coloraxis", hovertemplate=hover, name=title, **where)
        for line in lines:
            add_level(fig, x.values, y.values, line.values, line.level, line.dash, where)
        if best:
            j, i = np.unravel_index(np.nanargmax(z), z.shape)
            style = {"mode": "markers", "marker": STAR, "name": "largest", "showlegend": col == 1, "cliponaxis": False}
            hover = f"largest: {z[j, i]:.4g} {unit}"
            fig.add_scatter(x=[x.values[i]], y=[y.values[j]], hovertemplate=hover, **style, **where)
    for line in lines:
        add_key(fig, line.text, line.dash)
    dress(fig, 410).update_layout(showlegend=True, hovermode="closest", margin_t=76, margin_b=70, coloraxis=colours)
    fig.update_layout(legend_yref="container", legend_y=1.0, legend_yanchor="top")
    fig.update_xaxes(title=x.title, nticks=7, showgrid=False, zeroline=False, range=edges(x.values)[[0, -1]].tolist())
    fig.update_yaxes(showgrid=False, zeroline=False, range=edges(y.values)[[0, -1]].tolist())
    return fig.update_yaxes(title=y.title, col=1)


def edges(centres: Float[np.ndarray, "n"]) -> Float[np.ndarray, "m"]:
    """Edges of the cells around points, half way between them."""
    if len(centres) == 1:
        return np.array([centres[0] - 0.5, centres[0] + 0.5])
    between = 0.5 * (centres[1:] + centres[:-1])
    return np.concatenate([[2 * centres[0] - between[0]], between, [2 * centres[-1] - between[-1]]])


def add_level(
    fig: go.Figure,
    x: Float[np.ndarray, "nx"],
    y: Float[np.ndarray, "ny"],
    z: Float[np.ndarray, "ny nx"],
    level: float,
    dash: str,
    where: dict[str, int],
) -> None:
    """Draw the line on which z has a level."""
    contours = {"coloring": "none", "start": level, "end": level, "size": 1}
    line = {"color": BLACK, "width": 2, "dash": dash}
    fig.add_contour(
        x=x, y=y, z=z, contours=contours, line=line, showscale=False, showlegend=False, hoverinfo="skip", **where
    )


def add_key(fig: go.Figure, text: str, dash: str) -> None:
    """Put a line of `add_level` into the legend."""
    line = {"color": BLACK, "width": 2, "dash": dash}
    fig.add_scatter(x=[None], y=[None], mode="lines", line=line, name=text, row=1, col=1)

"""How figures look: colours that colour-blind readers can tell apart, axes, units."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float

from nectosome.units import dimension_of, show_quantity, unit_to_si

from .markup import plain

# Okabe and Ito's palette, from the darkest on white to the lightest
BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
BLACK, GREY = "#222222", "#7a7f87"
CYCLE = (BLUE, VERMILLION, GREEN, PURPLE, ORANGE, SKY)

_SOURCES = {
    "drag": VERMILLION,
    "added_mass": GREEN,
    "hull_drag": ORANGE,
    "viscous": PURPLE,
    "weight": GREY,
    "buoyancy": SKY,
    "drive": BLUE,
}


class Scenes(NamedTuple):
    """Recordings of viser by the names of their buttons; one is shown at a time. See `view.scenes`."""

    recordings: dict[str, str]


class Panel(NamedTuple):
    """A figure on a page: a plot, scenes in 3-D, or the HTML of a table."""

    title: str
    caption: str
    figure: go.Figure | Scenes | str


def source_lines(names: Sequence[str]) -> list[dict[str, str]]:
    """Colour and dash of each of several loads and drives, no two alike.

    Sources that most robots have keep their colour in all figures; the others take free ones, drives before loads.
    """
    free = [(colour, dash) for dash in ("solid", "dash", "longdashdot") for colour in CYCLE]
    lines: dict[str, tuple[str, str]] = {name: (_SOURCES[name], "solid") for name in names if name in _SOURCES}
    for name in names:
        if name not in lines:
            lines[name] = next((style for style in free if style not in lines.values()), free[-1])
    return [dict(zip(("color", "dash"), lines[name], strict=True)) for name in names]


def readable(name: str) -> str:
    """Name of a load or coordinate as people write it."""
    return name.replace("_", " ")


def titled(name: Any, unit: str) -> str:
    """Title of an axis: a name of a dataset, with its unit where it has one."""
    return f"{plain(name)} ({plain(unit)})" if unit not in ("", "1") else plain(name)


def easy_unit(values: Float[np.ndarray, "*n"], unit: str) -> tuple[float, str]:
    """Factor from SI to a unit in which the largest of some values is easy to read, and that unit."""
    dimension, known = dimension_of(unit), values[np.isfinite(values)]
    if dimension == "number" or not known.size:
        return 1.0, unit
    easy = show_quantity(float(np.abs(known).max()), dimension).partition(" ")[2]
    return 1 / unit_to_si(easy)[0], easy


def dress(fig: go.Figure, height: int, labels: int = 0) -> go.Figure:
    """Give a figure the common look: `height` [px] in all, and `labels` [px] on the right for the ends of lines."""
    fig.update_layout(
        template="none",
        height=height,
        margin={"l": 76, "r": max(labels, 20), "t": 34, "b": 60},
        font={"family": "system-ui, sans-serif", "size": 13, "color": BLACK},
        hovermode="x unified",
        showlegend=False,
        legend={"orientation": "h", "x": 0, "y": 1.0, "yanchor": "bottom", "traceorder": "normal"},
    )
    fig.update_annotations(font_size=13)
    line = {"showgrid": True, "gridcolor": "#e6e8eb", "zeroline": True, "zerolinecolor": "#b9bec5", "ticks": "outside"}
    fig.update_xaxes(linecolor=BLACK, title_standoff=8, **line)
    fig.update_yaxes(linecolor=BLACK, **line)
    return fig


def span(values: Sequence[float], room: float = 0.08) -> tuple[float, float]:
    """Smallest and largest of the finite values, and `room` of their distance beyond each."""
    finite = np.asarray(values, dtype=float)
    finite = finite[np.isfinite(finite)]
    low, high = (float(finite.min()), float(finite.max())) if finite.size else (0.0, 1.0)
    more = room * (high - low) or 0.05 * abs(high) or 1.0
    return low - more, high + more

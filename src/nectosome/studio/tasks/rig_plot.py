"""The channels of a rig under one another, as a figure for the panel: measurements, then commands."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
from jaxtyping import Float
from plotly.subplots import make_subplots

from nectosome.io import load_dataset
from nectosome.units import dimension_of, show_quantity, unit_to_si
from nectosome.view.style import BLACK, BLUE, GREY

from .left_panel import small

_POINTS = 250  # of a line, each with the least and the largest value around it
_HEIGHT = 0.32  # of a channel, as a share of the width


def channels_figure(units: Mapping[str, str], rows: Float[np.ndarray, "n columns"]) -> tuple[go.Figure, float]:
    """Figure of rows of a run's log, and its height as a share of its width; `units` are those of their columns."""
    column = dict(zip(units, rows.T, strict=True))
    lines = _lines_of(units)
    fig = make_subplots(len(lines), 1, shared_xaxes=True, vertical_spacing=0.3 / len(lines))
    for row, (name, drawn) in enumerate(lines.items(), start=1):
        size, unit = _scale(np.concatenate([column[of] for of in drawn]), units[name])
        for of, line in drawn.items():
            time, values = _thinned(column["time"], column[of])
            fig.add_scatter(x=time, y=size * values, line=line, mode="lines", name=of, row=row, col=1)
        title = f"{name} ({unit})" if unit else name
        fig.add_annotation(
            text=title, x=0, xref="paper", xanchor="left", y=1.0, yref=f"y{row if row > 1 else ''} domain",
            yanchor="bottom", showarrow=False, font_size=11,
        )  # fmt: skip
    small(fig).update_layout(height=None, showlegend=False, margin={"l": 44, "r": 8, "t": 22, "b": 36})
    fig.update_yaxes(nticks=5).update_xaxes(title="time (s)", row=len(lines))
    return fig, _HEIGHT * len(lines) + 0.12


def logged(path: Path) -> tuple[dict[str, str], Float[np.ndarray, "n columns"]]:
    """Units of the columns of a run's log, and all its rows."""
    data = load_dataset(path)
    units = {str(name): str(data[name].attrs["units"]) for name in ("time", *data.data_vars)}
    return units, np.stack([data[name].values for name in units], axis=1)


def _lines_of(units: Mapping[str, str]) -> dict[str, dict[str, dict[str, object]]]:
    """Columns that are drawn together, with their lines, by the one that names them.

    With a measurement are drawn its reference, and the command of the same name and unit, as that of a servo.
    """
    found: dict[str, dict[str, dict[str, object]]] = {}
    commands = [name for name in units if name.endswith(".command")]
    drawn = {name for name in units if name in ("time", "late") or name.endswith((".command", ".reference"))}
    for name in (name for name in units if name not in drawn):
        lines: dict[str, dict[str, object]] = {name: {"color": BLUE, "width": 1.3}}
        if f"{name}.reference" in units:
            lines[f"{name}.reference"] = {"color": BLACK, "width": 1.2, "dash": "dot"}
        if units.get(f"{name}.command") == units[name]:
            commands.remove(f"{name}.command")
            lines[f"{name}.command"] = {"color": GREY, "width": 1.2}
        found[name] = lines
    return found | {name: {name: {"color": GREY, "width": 1.3}} for name in commands}


def _scale(values: Float[np.ndarray, "n"], unit: str) -> tuple[float, str]:
    """Factor from SI to a unit in which the largest value is easy to read, and that unit."""
    dimension, known = dimension_of(unit), values[np.isfinite(values)]
    if dimension == "number" or not known.size:
        return 1.0, unit
    shown = show_quantity(float(np.abs(known).max()), dimension).partition(" ")[2]
    return (1 / unit_to_si(shown)[0], shown) if shown else (1.0, "")


def _thinned(
    time: Float[np.ndarray, "n"], values: Float[np.ndarray, "n"]
) -> tuple[Float[np.ndarray, "m"], Float[np.ndarray, "m"]]:
    """At most twice as many points as are drawn, without loss of peaks: of each piece the least and the largest."""
    each = len(time) // _POINTS
    if each <= 2:
        return time, values
    count = len(time) // each
    pieces = values[: count * each].reshape(count, each)
    known = np.where(np.isfinite(pieces), pieces, 0.0)
    ends = np.sort(np.stack([known.argmin(axis=1), known.argmax(axis=1)], axis=1), axis=1)
    k = np.append((ends + each * np.arange(count)[:, None]).ravel(), np.arange(count * each, len(time)))
    return time[k], values[k]

"""Figures of the tracker's study: joint angles beside simulated ones, tracks and their errors, degraded videos."""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.style import BLACK, BLUE, GREY, VERMILLION, Panel, dress, plain

from .. import charts
from ..study import Sets

if TYPE_CHECKING:
    import xarray as xr

_TICKS = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50]  # of logarithmic axes


def panels(data: Sets) -> list[Panel]:
    """All figures for which there is data: `angles`, `walk`, `swim`, `limits_paddle`, `limits_tank`."""
    out = [*charts.panels("track", data).values()]
    titles = {"walk": "PoseiDRONE walks, tracked", "swim": "PoseiDRONE swims, tracked"}
    out += [_track(data[key], title) for key, title in titles.items() if key in data]
    for key, title, factor, unit in (
        ("limits_paddle", "Degraded videos: angles of the paddle", 180 / np.pi, "deg"),
        ("limits_tank", "Degraded videos: places of the markers", 1e3, "mm"),
    ):
        if key in data:
            out.append(_limits(data[key], title, factor, unit))
    return out


def _track(data: "xr.Dataset", title: str) -> Panel:
    """Places along x and z, and their errors."""
    from plotly.subplots import make_subplots

    fig = make_subplots(3, 1, shared_xaxes=True, vertical_spacing=0.06)
    time = data["time"].values
    for row, axis, colour in ((1, "x", BLUE), (2, "z", VERMILLION)):
        found, true = (1e3 * data[name].sel(axis=axis).values for name in ("position", "true_position"))
        line = {"color": BLACK, "width": 3}
        fig.add_scatter(x=time, y=true, line=line, name="rendered", showlegend=row == 1, row=row, col=1)
        fig.add_scatter(x=time, y=found, line={"color": colour, "width": 1.2}, name=f"tracked {axis}", row=row, col=1)
        fig.update_yaxes(title=f"{axis} (mm)", row=row)
    for axis, colour in (("x", BLUE), ("y", GREY), ("z", VERMILLION)):
        off = 1e3 * (data["position"] - data["true_position"]).sel(axis=axis).values
        fig.add_scatter(x=time, y=off, line={"color": colour, "width": 1}, name=f"error of {axis}", row=3, col=1)
    fig.update_yaxes(title="error (mm)", row=3)
    fig.update_xaxes(title="time (s)", row=3)
    dress(fig, 620).update_layout(showlegend=True, hovermode="closest", margin_t=80, legend_y=1.12)
    se = 1e3 * np.nanmedian(data["position_se"].values, axis=0)
    caption = (
        "Synthetic: the centre of mass from two rendered videos, and as it was. y is the depth in the tank, along "
        f"which two cameras see least well: standard errors of x, y, z are {se[0]:.2f}, {se[1]:.2f}, {se[2]:.2f} mm."
    )
    return Panel(title, caption, fig)


def _limits(data: "xr.Dataset", title: str, factor: float, unit: str) -> Panel:
    """Error and share seen, kind by kind, with a mark at the level where the tracker breaks."""
    from plotly.subplots import make_subplots

    kinds = [str(kind) for kind in data["kind"].values]
    units = [str(one) for one in data["unit"].values]
    columns = 3
    rows = -(-len(kinds) // columns)
    fig = make_subplots(
        rows, columns, subplot_titles=[plain(kind) for kind in kinds], vertical_spacing=0.13, horizontal_spacing=0.08
    )
    limit = factor * float(data.attrs["limit"])
    words = []
    for k, (kind, one) in enumerate(zip(kinds, units, strict=True)):
        row, col = k // columns + 1, k % columns + 1
        there = np.isfinite(data["level"].values[k])
        level, rms, seen = (data[name].values[k][there] for name in ("level", "rms", "seen"))
        text = [f"{_level(x, one)}" for x in level]
        fig.add_scatter(
            x=text, y=factor * rms, mode="lines+markers", line={"color": BLUE}, name="rms error", showlegend=k == 0,
            marker={"size": 5 + 9 * seen, "color": BLUE}, hovertext=[f"{x:.0%} seen" for x in seen], row=row, col=col,
        )  # fmt: skip
        fig.add_scatter(
            x=text, y=[limit] * len(text), mode="lines", line={"color": GREY, "dash": "dot", "width": 1},
            name="required", showlegend=k == 0, row=row, col=col,
        )  # fmt: skip
        broken = int(data["broken"].values[k])
        if broken >= 0:
            y = factor * rms[broken] if np.isfinite(rms[broken]) else limit
            fig.add_scatter(
                x=[text[broken]], y=[y], mode="markers", name="broken", showlegend=not words,
                marker={"symbol": "x", "size": 11, "color": VERMILLION}, row=row, col=col,
            )  # fmt: skip
            off = f"{seen[broken]:.0%} seen, {factor * rms[broken]:.2g} {unit}"
            why = off if np.isfinite(rms[broken]) else "refused"
            words.append(f"{kind} at {text[broken]} {one.split(',')[0]} ({why})".replace("  ", " "))
        fig.update_xaxes(type="category", title=plain(one), row=row, col=col)
        fig.update_yaxes(type="log", tickvals=_TICKS, row=row, col=col)
        if col == 1:
            fig.update_yaxes(title=f"rms ({unit})", row=row, col=col)
    dress(fig, 270 * rows).update_layout(showlegend=True, hovermode="closest", margin_t=90, legend_y=1.1)
    caption = (
        f"Synthetic: each kind of degradation alone, the others as in the study. Dotted: required, {limit:g} {unit}; "
        "dots are the smaller the fewer were seen. It breaks where the error is larger or less than half is seen: "
        + ("; ".join(words) or "nowhere")
        + "."
    )
    return Panel(title, caption, fig)


def _level(x: float, unit: str) -> str:
    scaled = {"px/cm": x / 100 if x > 20 else x, "mm": 1e3 * x}.get(unit, x)
    return f"{scaled:g}"

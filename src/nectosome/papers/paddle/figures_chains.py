"""Chains of links that a drive swings in the plane, drawn at instants of a cycle."""

from typing import TYPE_CHECKING, Any

import numpy as np
from jaxtyping import Float

from nectosome.view.style import BLUE, VERMILLION, dress

if TYPE_CHECKING:
    import plotly.graph_objects as go
    import xarray as xr


def chain(run: "xr.Dataset") -> Float[np.ndarray, "t n 2"]:
    """Points of a chain in the plane [m] from root to tip: its stations in the order of parts and along them."""
    parts = [str(part) for part in run["part"].values]
    stations = zip(run["station_part"].values, run["station_x"].values, strict=True)
    places = [(parts.index(str(part)), x) for part, x in stations]
    return run["position"].values[:, sorted(range(len(places)), key=places.__getitem__), :2]


def strokes(run: "xr.Dataset", drive: str, most: int = 7) -> list[np.ndarray]:
    """Moments of the stroke in which a drive goes forward, and of the way back; at most so many of each."""
    forward = run["drive_velocity"].sel(prescribed=drive).values[:-1] > 0
    found = []
    for way in (forward, ~forward):
        first = int(np.flatnonzero(way & ~np.roll(way, 1))[0])
        steps = np.linspace(0, int(way.sum()) - 1, most).round().astype(int)
        found.append((first + np.unique(steps)) % forward.size)
    return found


def strokes_figure(run: "xr.Dataset", drive: str, titles: tuple[str, str]) -> "go.Figure":
    """The chain in the stroke forward and on the way back, side by side to scale; later is darker."""
    from plotly.subplots import make_subplots

    fig = make_subplots(1, 2, shared_yaxes=True, horizontal_spacing=0.03, subplot_titles=titles)
    points, time = 1e3 * chain(run), run["time"].values
    for col, (instants, colour) in enumerate(zip(strokes(run, drive), (BLUE, VERMILLION), strict=True), start=1):
        where: Any = {"row": 1, "col": col}
        for k, opacity in zip(instants, np.linspace(0.25, 1.0, len(instants)), strict=True):
            fig.add_scatter(
                x=points[k, :, 0],
                y=points[k, :, 1],
                mode="lines",
                line={"color": colour, "width": 3},
                opacity=opacity,
                name=f"{time[k]:.3f} s",
                hovertemplate="(%{x:.0f}, %{y:.0f}) mm",
                **where,
            )
        tips = points[instants, -1]
        dots = {"color": colour, "size": 6}
        fig.add_scatter(x=tips[:, 0], y=tips[:, 1], mode="markers", marker=dots, hoverinfo="skip", **where)
    fig.update_xaxes(matches="x", constrain="domain")
    fig.update_yaxes(scaleanchor="x", constrain="domain", col=1)
    fig.update_xaxes(title="x (mm)")
    fig.update_yaxes(title="y (mm)", col=1)
    return dress(fig, 600).update_layout(hovermode="closest", margin_t=60)

"""Figures of the gallery: all robots in one scene, moving, and how they get under way."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.scenes import Actor, side_by_side
from nectosome.view.style import CYCLE, Panel, dress

if TYPE_CHECKING:
    import xarray as xr

_PICTURES, _SECONDS = 31, 1.5  # of a period, and how long it is shown


def panels(runs: Mapping[str, "xr.Dataset"]) -> list[Panel]:
    """All figures, from the runs of the study by name."""
    return [_together(runs), _from_rest(runs)]


def _together(runs: Mapping[str, "xr.Dataset"]) -> Panel:
    actors = []
    for run in runs.values():
        end, period = float(run["time"][-1]), float(run.attrs["period"])
        times = np.linspace(end - period, end, _PICTURES)
        label = f"{run.attrs['label']}, {float(run.attrs['speed']):.3f} m/s"
        actors.append(Actor(run, times, label))
    caption = (
        "Simulated, in real proportions, over the last period of each. Each robot is kept in its place; all periods "
        "are shown in the same time. Drag to turn, scroll to come nearer; the scenes below show each robot alone."
    )
    return Panel("The robots in motion", caption, side_by_side(actors, _SECONDS, columns=4))


def _from_rest(runs: Mapping[str, "xr.Dataset"]) -> Panel:
    """Mean speed over the period before each instant, against time."""
    import plotly.graph_objects as go

    fig = go.Figure()
    for i, run in enumerate(runs.values()):
        time, period = run["time"].values, float(run.attrs["period"])
        place = run["position"].values[:, 0]
        later = time >= period * (1 - 1e-9)
        before = np.stack([np.interp(time[later] - period, time, place[:, k]) for k in range(3)], axis=-1)
        speed = np.linalg.norm(place[later] - before, axis=-1) / period
        line = {"color": CYCLE[i % len(CYCLE)], "dash": ("solid", "dash")[i // len(CYCLE) % 2]}
        fig.add_scatter(x=time[later], y=speed, name=str(run.attrs["label"]), line=line)
    fig.update_xaxes(title="time from rest (s)")
    fig.update_yaxes(title="speed, mean of a period (m/s)", type="log")
    dress(fig, 440).update_layout(showlegend=True, hovermode="closest", margin_t=84)
    return Panel("From rest", "Simulated distance over the period before each instant, divided by the period.", fig)

"""Figures of the gallery: all robots in one scene, moving, and how they get under way."""

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from nectosome.view.robot3d import actor, stage
from nectosome.view.style import CYCLE, Panel, dress
from nectosome.view.tubes import tubes

if TYPE_CHECKING:
    import xarray as xr

_FRAMES = 12  # of a period
_APART = 0.08  # m between robots


def panels(runs: Mapping[str, "xr.Dataset"]) -> list[Panel]:
    """All figures, from the runs of the study by name."""
    return [_together(runs), _from_rest(runs)]


def _together(runs: Mapping[str, "xr.Dataset"]) -> Panel:
    actors, y = [], 0.0
    for run in runs.values():
        end, period = float(run["time"][-1]), float(run.attrs["period"])
        times = end - period * (1 - np.arange(_FRAMES) / _FRAMES)
        across = np.concatenate([rings[0, ..., 1].ravel() for rings in tubes(run, times[:1]).values()])
        middle = float(np.interp(times[0], run["time"].values, run["position"].values[:, 0, 1]))
        near, far = middle - float(across.min()), float(across.max()) - middle
        label = f"{run.attrs['label']}, {float(run.attrs['speed']):.3f} m/s"
        actors.append(actor(run, times, label, at=(0.0, y + near, 0.0)))
        y += near + far + _APART
    moments = [f"{k / _FRAMES:.2f}" for k in range(_FRAMES)]
    caption = (
        "Simulated, in real proportions, over the last period of each: the menu shows one of them up close. They are "
        "seen by observers who go along with them, and their periods are shown as long as one another."
    )
    return Panel("The robots in motion", caption, stage(actors, moments, True, "share of a period ", 640))


def _from_rest(runs: Mapping[str, "xr.Dataset"]) -> Panel:
    """Mean speed over the period before each moment, against time."""
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
    return Panel("From rest", "Simulated distance over the period before each moment, divided by the period.", fig)

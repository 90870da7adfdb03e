"""The gallery: each robot swims from rest until it keeps its motion; speed, power and cost of transport of a period."""

import time
from typing import Any

import jax.numpy as jnp
import numpy as np
import plotly.graph_objects as go
import xarray as xr

from nectosome.core import STANDARD_GRAVITY
from nectosome.description import drive_period
from nectosome.loads import Jet
from nectosome.mechanism import Robot
from nectosome.mechanism.diagnose import driving
from nectosome.model import build
from nectosome.search import Workers
from nectosome.solve import simulate
from nectosome.view.scenes import Actor, side_by_side
from nectosome.view.style import CYCLE, Panel, dress

from ..poseidrone.static_free import pulses
from ..study import Progress, Sets, StudyPart, collected, score
from .entries import ENTRIES

NAME = "gallery"
A_PERIOD = 48  # samples in each
_RTOL, _QUICK_RTOL = 1e-5, 1e-4  # of time steps; looser ones go over the pulses of a jet
_WORKERS = 2  # processes: most of the time goes into compiling
_QUANTITIES = {
    "speed": ("mean speed", "m/s"),
    "power": ("mean power of the drives", "W"),
    "cost-of-transport": ("cost of transport", "1"),
    "frequency": ("frequency of the drives", "Hz"),
}


def part(quick: bool, progress: Progress) -> StudyPart:
    """All runs and rows; `quick` lets each robot swim half as long, by looser steps, so that some have not settled."""
    with Workers(_WORKERS) as workers:
        waiting = {workers.pool.submit(swum, entry.name, quick): entry.name for entry in ENTRIES}
        total = len(ENTRIES)
        runs = collected(waiting, lambda count: progress(f"{count} of {total} robots", count / total))
    rows = [row for name, one in runs.items() for row in _rows(name, one)]
    return StudyPart({}, runs=runs, rows=rows)


def swum(name: str, quick: bool = False) -> xr.Dataset:
    """Run of a robot of the gallery from rest; what it does over its last period is in its attributes.

    `speed` [m/s], `power` [W], `cost-of-transport` [1], `frequency` [Hz], `change`: of the speed in the last period,
    relative to it; `seconds` that it all took. Raises RuntimeError where the run did not succeed.
    """
    began = time.perf_counter()
    entry = next(entry for entry in ENTRIES if entry.name == name)
    description = entry.make()
    period, periods = drive_period(description), entry.periods // 2 if quick else entry.periods
    rtol = _QUICK_RTOL if quick else _RTOL
    robot = build(description)
    solution = simulate(robot, periods * period, samples=A_PERIOD * periods + 1, rtol=rtol, atol=1e-2 * rtol)
    made = solution.to_dataset({"robot": name, "periods": periods, "quick": quick, "rtol": rtol})
    if made.attrs["status"] != "SOLVED":
        raise RuntimeError(f"gallery: {name} did not swim: {made.attrs['status_reason']}")
    made.attrs |= numbers(robot, made, period) | {"label": entry.title, "period": period}
    made.attrs["seconds"] = round(time.perf_counter() - began, 1)
    return made


def numbers(robot: Robot, made: xr.Dataset, period: float) -> dict[str, float]:
    """What a robot does over the last period [s] of a run with `A_PERIOD` samples in each, as in `swum`.

    The speed is that between the period's ends. The power is that of joints' drives, of what acts inside rods, and of
    what turns the crank of a jet.
    """
    place = made["position"].values[::-A_PERIOD, 0][:3]
    last, before = np.linalg.norm(np.diff(place, axis=0), axis=-1) / period
    once = made.isel(time=slice(-A_PERIOD, None))
    power = float(once["reaction_power"].mean("time").sum())
    power += float(np.mean(once["load_power"].values, axis=0)[driving(robot)].sum()) + _crank_power(robot, once)
    return {
        "speed": float(last),
        "power": power,
        "cost-of-transport": power / (float(jnp.sum(robot.weight())) * STANDARD_GRAVITY * float(last)),
        "frequency": 1 / period,
        "change": float(last / before - 1),
    }


def _crank_power(robot: Robot, once: xr.Dataset) -> float:
    """Mean power [W] that turns the crank of a jet on the body, along its x through its centre; 0 without one."""
    if not any(isinstance(g.load, Jet) for g in robot.load_groups.acting):
        return 0.0
    along = np.einsum("ti,ti->t", once["velocity"].values[:, 0], once["rotation"].values[:, 0, :, 0])
    pulse = pulses(robot, jnp.asarray(once["time"].values), (), jnp.asarray(along))
    return float(jnp.mean(pulse.torque * pulse.speed))


def _rows(name: str, made: xr.Dataset) -> list[dict[str, Any]]:
    """Rows of one robot; what is printed of some is in the studies of these."""
    settled = f"From rest; in the last period the speed changed by {100 * made.attrs['change']:+.2g} %."
    return [
        score(
            f"{NAME}/{name}/{key}",
            {"quantity": f"{quantity} of the {made.attrs['title'].partition(':')[0]}", "unit": unit, "kind": "own"}
            | {"note": settled if key == "speed" else ""},
            made.attrs[key],
        )
        for key, (quantity, unit) in _QUANTITIES.items()
    ]


_PICTURES, _SECONDS = 31, 1.5  # of a period, and how long it is shown


def panels(data: Sets, runs: Sets) -> list[Panel]:
    """All robots in one scene, moving, and how they get under way."""
    return [_together(runs), _from_rest(runs)]


def _together(runs: Sets) -> Panel:
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


def _from_rest(runs: Sets) -> Panel:
    """Mean speed over the period before each instant, against time."""
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

"""The gallery: each robot swims from rest until it keeps its motion; speed, power and cost of transport of a period."""

import time
from concurrent.futures import as_completed
from typing import TYPE_CHECKING, Any

import jax.numpy as jnp
import numpy as np

from nectosome.core import STANDARD_GRAVITY
from nectosome.description import drive_period
from nectosome.loads import Jet
from nectosome.mechanism import Robot
from nectosome.mechanism.diagnose import driving
from nectosome.model import build
from nectosome.search import Workers
from nectosome.solve import simulate

from ..poseidrone.static_free import pulses
from ..study import Progress, Study, score
from . import figures
from .entries import ENTRIES

if TYPE_CHECKING:
    import xarray as xr

NAME = "gallery"
TITLE = "Gallery of swimming robots"
ABOUT = (
    "Robots that ship, most of them free in space or in a plane, swim from rest until they keep their motion. They are "
    "here to be seen, and to stay as they are; what is published of some is held against them in other studies."
)
A_PERIOD = 48  # samples in each
_RTOL, _QUICK_RTOL = 1e-5, 1e-4  # of time steps; looser ones go over the pulses of a jet
_WORKERS = 2  # processes: most of the time goes into compiling
_UNITS = {"speed": "m/s", "power": "W", "cost-of-transport": "1", "frequency": "Hz"}
_QUANTITIES = {
    "speed": "mean speed",
    "power": "mean power of the drives",
    "cost-of-transport": "cost of transport",
    "frequency": "frequency of the drives",
}


def run(quick: bool, progress: Progress) -> Study:
    """All runs and rows; `quick` lets each robot swim half as long, by looser steps, so that some have not settled."""
    began = time.perf_counter()
    runs: dict[str, xr.Dataset] = {}
    with Workers(_WORKERS) as workers:
        waiting = {workers.pool.submit(swum, entry.name, quick): entry.name for entry in ENTRIES}
        for future in as_completed(waiting):
            runs[waiting[future]] = future.result()
            progress(f"{len(runs)} of {len(ENTRIES)} robots", len(runs) / len(ENTRIES))
    runs = {entry.name: runs[entry.name] for entry in ENTRIES}
    rows = [row for name, one in runs.items() for row in _rows(name, one)]
    return Study(
        NAME, TITLE, ABOUT, rows, runs, time.perf_counter() - began, figures=lambda data, runs: figures.panels(runs)
    )


def swum(name: str, quick: bool = False) -> "xr.Dataset":
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


def numbers(robot: Robot, made: "xr.Dataset", period: float) -> dict[str, float]:
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


def _crank_power(robot: Robot, once: "xr.Dataset") -> float:
    """Mean power [W] that turns the crank of a jet on the body, along its x through its centre; 0 without one."""
    if not any(isinstance(attached.load, Jet) for attached in robot.loads):
        return 0.0
    along = np.einsum("ti,ti->t", once["velocity"].values[:, 0], once["rotation"].values[:, 0, :, 0])
    pulse = pulses(robot, jnp.asarray(once["time"].values), (), jnp.asarray(along))
    return float(jnp.mean(pulse.torque * pulse.speed))


def _rows(name: str, made: "xr.Dataset") -> list[dict[str, Any]]:
    """Rows of one robot; what is printed of some is in the studies of these."""
    settled = f"From rest; in the last period the speed changed by {100 * made.attrs['change']:+.2g} %."
    return [
        score(
            f"{NAME}/{name}/{key}",
            {"quantity": f"{quantity} of the {made.attrs['title'].partition(':')[0]}", "unit": _UNITS[key]}
            | {"note": settled if key == "speed" else ""},
            made.attrs[key],
        )
        for key, quantity in _QUANTITIES.items()
    ]

"""Scenes for a page, which turn and play without a server: a run, or several robots side by side."""

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import xarray as xr
from jaxtyping import Float

from nectosome.description import WaterDescription, drive_period
from nectosome.units import InputError

from .saved import check_drawable
from .style import BLUE, Scenes
from .tubes import between, description, near_times, nearest_rotation

if TYPE_CHECKING:
    from .display.scene_graph import Stage

_PERIODS = 3
_SECONDS = 5.0  # of a motion that is not periodic
_CAMERA = (-0.25, -1.0, 0.35)  # direction of the camera on robots side by side
_APART = 0.25  # of the largest robot, between robots
_ABOVE = 0.03  # of the largest robot, from one to its label
_BOXED = 3  # every third picture is used to find the room that a robot takes


class Actor(NamedTuple):
    """A robot among others: its run at `times` [s], with its body kept in one place."""

    run: xr.Dataset
    times: Float[np.ndarray, "t"]
    label: str
    soft: str = BLUE  # colour of its rods


def run_scene(run: xr.Dataset) -> Scenes:
    """Record a whole run, or one instant, in its own time, with a camera that goes along with the body."""
    from .display.offline import recording
    from .display.scene_graph import Look

    return Scenes({"": recording(lambda stage: stage.load(run, description(run), 0.0, Look()))})


def picture_interval(times: Float[np.ndarray, "t"]) -> float:
    """Time between two pictures of the scene of a run that is saved at these times [s]."""
    from .display.offline import pictures

    seconds = float(times[-1] - times[0])
    return max(seconds / max(pictures(seconds) - 1, 1), seconds / max(len(times) - 1, 1))


def last_periods(runs: Mapping[str, xr.Dataset]) -> Scenes | None:
    """Record the last three periods, or five seconds, of each run that carries its robot; None where none does."""
    shown = {name: run_scene(_end(run)).recordings[""] for name, run in runs.items() if is_drawable(run)}
    return Scenes(shown) if shown else None


def side_by_side(actors: Sequence[Actor], seconds: float, columns: int = 3) -> Scenes:
    """Record robots in one scene, row under row, each in `seconds` whatever its own time is."""
    from .display.bodies import Arrows, bodies_of
    from .display.offline import recording
    from .display.playback import Playback
    from .display.scene_graph import Look

    def put(stage: "Stage") -> None:
        bodies, boxes, steps = [], [], len(actors[0].times)
        for actor in actors:
            run = _at(actor.run, actor.times)
            away = -run["position"].values[:, 0]
            own = {name: body.moved(away) for name, body in bodies_of(run, description(run), actor.soft).items()}
            corners = np.concatenate([body.corners(k) for body in own.values() for k in range(0, steps, _BOXED)])
            bodies.append(own)
            boxes.append((corners.min(axis=0), corners.max(axis=0)))
        places, tops = _grid(np.array(boxes), columns)
        still, none = np.zeros((steps, 3)), np.zeros((steps, 0, 3))
        every = {f"{k}-{name}": b.moved(still + places[k]) for k, own in enumerate(bodies) for name, b in own.items()}
        playback = Playback(np.linspace(0.0, seconds, steps), still)
        stage.put(playback, every, Arrows((), (), none, none, np.zeros(0, int)), WaterDescription(), Look(path=False))
        for k, actor in enumerate(actors):
            stage.write(f"label-{k}", actor.label, tops[k])

    return Scenes({"": recording(put, _CAMERA)})


def _grid(boxes: Float[np.ndarray, "n 2 3"], columns: int) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """Places of robots in rows along x, one under the other, and of their labels [m], from their boxes."""
    size, middle = boxes[:, 1] - boxes[:, 0], boxes.mean(axis=1)
    row, column = np.divmod(np.arange(len(boxes)), columns)
    wide = np.array([size[column == k, 0].max() for k in range(column.max() + 1)]) + _APART * size[:, 0].max()
    high = np.array([size[row == k, 2].max() for k in range(row.max() + 1)]) + _APART * size.max()
    x, z = np.cumsum(wide) - 0.5 * wide, -np.cumsum(high) + 0.5 * high
    cells = np.stack([x[column], np.zeros(len(boxes)), z[row]], axis=-1)
    labels = cells.copy()
    labels[:, 2] += 0.5 * size[:, 2] + 0.25 * size[:, 1] + _ABOVE * size.max()  # seen from above, what is far is high
    return cells - middle, labels


def _end(run: xr.Dataset) -> xr.Dataset:
    robot, time = description(run), run["time"].values
    try:
        seconds = _SECONDS if robot is None else _PERIODS * drive_period(robot)
    except InputError:
        seconds = _SECONDS
    return run.isel(time=slice(int(np.searchsorted(time, time[-1] - seconds)), None))


def is_drawable(run: xr.Dataset) -> bool:
    """Whether a run carries a robot that can be drawn."""
    if "position" not in run or run.sizes.get("time", 0) < 2 or description(run) is None:
        return False
    try:
        check_drawable(run, "")
    except InputError:
        return False
    return True


def _at(run: xr.Dataset, times: Float[np.ndarray, "t"]) -> xr.Dataset:
    """Places and rotations of a run at other times [s], by cubics through the saved ones."""
    near = near_times(run, times)
    place, turn = (between(near["time"].values, near[name].values, times) for name in ("position", "rotation"))
    own = near.drop_vars([str(name) for name, values in near.data_vars.items() if "time" in values.dims])
    moved = {"position": ("time", "station", "axis"), "rotation": ("time", "station", "row", "axis")}
    values = dict(zip(moved, (place, nearest_rotation(turn)), strict=True))
    return own.drop_vars("time").assign({name: (dims, values[name]) for name, dims in moved.items()})

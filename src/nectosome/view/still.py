"""A robot that does not move: as it starts, to be drawn like a run, and its page, a picture that turns and numbers."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import xarray as xr
from jaxtyping import ArrayLike

from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, dump_robot
from nectosome.mechanism import Robot, Tree
from nectosome.mechanism.robot import start_poses

from .markup import plain
from .page import write_page
from .scenes import run_scene
from .style import Panel
from .tubes import description

Rows = Sequence[Sequence[str]]


def standing(described: RobotDescription, robot: Robot) -> xr.Dataset:
    """One instant, without forces."""
    rotation, position = remembered(start_poses, robot)
    stations = robot.tree.stations
    return instant(described, robot.tree, 0.0, (rotation, position, stations.x, stations.half_width))


def instant(described: RobotDescription, tree: Tree, time: float, stations: Iterable[ArrayLike]) -> xr.Dataset:
    """One instant of a robot, by its stations: rotations, positions, places along their parts and half widths [m]."""
    rotation, position, x, half_width = map(np.asarray, stations)
    of_stations = np.array(tree.names)[tree.indices.part_of_station]
    return xr.Dataset(
        {
            "position": (("time", "station", "axis"), position[None]),
            "rotation": (("time", "station", "row", "axis"), rotation[None]),
            "station_x": ("station", x),
            "half_width": (("station", "across"), half_width),
        },
        coords={"time": [time], "part": [*tree.names], "station_part": ("station", of_stations)},
        attrs={"title": described.name, "robot": dump_robot(described)},
    )


def show_still(run: xr.Dataset, path: str | Path, tables: Sequence[Rows], more: Sequence[Panel] = ()) -> None:
    """Write a page with the robot of a run as it is at first, tables of numbers, the first row their heads, and `more`.

    The page works offline and is written whole or not at all. Raises InputError where it cannot be written.
    """
    title = str(run.attrs.get("title") or "robot")
    robot = description(run)
    about = [] if robot is None else [f"<p>{plain(robot.about)}</p>"]
    scene = Panel("The robot", "Drag to turn, scroll to come nearer. z is up.", run_scene(run.isel(time=slice(1))))
    write_page(path, title, [*about, scene, *map(html_table, tables), *more])


def html_table(rows: Rows) -> str:
    """A table, the first row its heads."""
    heads, *body = rows
    cells = ("".join(f"<td>{plain(text)}</td>" for text in row) for row in body)
    inner = "\n".join(f"<tr>{row}</tr>" for row in cells)
    head = "".join(f"<th>{plain(cell)}</th>" for cell in heads)
    return f'<div class="wide"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{inner}\n</tbody></table></div><br>'

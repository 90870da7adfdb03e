"""A robot at rest: as it starts, to be drawn like a run, its page, a picture that turns, numbers, righting curves."""

from collections.abc import Iterable, Sequence
from pathlib import Path

import numpy as np
import plotly.graph_objects as go
import xarray as xr
from jaxtyping import ArrayLike, Float

from nectosome.core.programs.remember import remembered
from nectosome.description import RobotDescription, dump_robot
from nectosome.mechanism import Robot, Tree
from nectosome.mechanism.robot import start_poses

from .markup import plain
from .page import write_page
from .scenes import run_scene
from .style import BLUE, GREY, ORANGE, Panel, dress
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


def righting_panel(
    heels: Float[np.ndarray, "n"],
    starboard: Float[np.ndarray, "n"],
    port: Float[np.ndarray, "n"],
    rest: float,
    height: float,
) -> Panel:
    """Righting arms [m] at heels [rad] to each side.

    Beside them lines of the metacentric height [m] from the heel `rest` [rad], to starboard.
    """
    degrees = np.degrees(heels)
    most = float(np.abs([starboard, port]).max()) or 1.0
    factor, unit = (1e3, "mm") if most < 0.5 else (1.0, "m")
    fig = go.Figure()
    sides = (
        ("to starboard", starboard, rest, {"color": BLUE}),
        ("to port", port, -rest, {"color": ORANGE, "dash": "dash"}),
    )
    for name, arms, lies, line in sides:
        near = np.abs(heels - lies) <= 1.0
        dotted, small = {"color": GREY, "dash": "dot"}, factor * height * (heels - lies)[near]
        by_height = {"name": "by the metacentric height", "showlegend": arms is starboard}
        fig.add_scatter(x=degrees[near], y=small, mode="lines", line=dotted, **by_height)
        fig.add_scatter(x=degrees, y=factor * arms, mode="lines", line=line, name=name)
    fig.update_xaxes(title="heel to starboard, heel to port (deg)", dtick=30, range=[0, float(degrees[-1])])
    fig.update_yaxes(title=f"righting arm GZ ({unit})", range=[-1.15 * factor * most, 1.15 * factor * most])
    caption = (
        "Above 0 the robot turns back; beyond the last zero it turns over. Judge it by the side with the smaller arms. "
        "Joints and trim are held, and it rises and sinks until it displaces its mass. Dotted: the metacentric height "
        "times the angle from where it is at rest."
    )
    return Panel("Righting arm", caption, dress(fig, 400).update_layout(showlegend=True))

"""A robot as it starts, to be drawn like a run: one instant, without forces."""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.core.remember import remembered
from nectosome.description import RobotDescription, dump_robot
from nectosome.mechanism import Robot
from nectosome.mechanism.robot import start_poses

if TYPE_CHECKING:
    import xarray as xr


def standing(description: RobotDescription, robot: Robot) -> "xr.Dataset":
    """What a picture of the robot is drawn from."""
    import xarray as xr

    rotation, position = remembered(start_poses, robot)
    bodies = {part.name: part.body for part in robot.tree.parts}
    of_stations = np.concatenate([[name] * body.x.size for name, body in bodies.items()])
    return xr.Dataset(
        {
            "position": (("time", "station", "axis"), np.asarray(position)[None]),
            "rotation": (("time", "station", "row", "axis"), np.asarray(rotation)[None]),
            "station_x": ("station", np.concatenate([body.x for body in bodies.values()])),
            "half_width": (("station", "across"), np.concatenate([body.half_width for body in bodies.values()])),
        },
        coords={"time": [0.0], "part": [*bodies], "station_part": ("station", of_stations)},
        attrs={"title": description.name, "robot": dump_robot(description)},
    )

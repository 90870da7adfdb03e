"""The scene of a run as one page that turns and plays without a server."""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.description import RobotDescription

from .gate import Gate, guarded_server
from .stage import Look, Stage

if TYPE_CHECKING:
    import xarray as xr

_PICTURES = 20  # a second
_MOST = 600  # pictures
_PERIODS = 3  # of what repeats itself
_NEARER = 0.8  # than in the studio, where panels stand to both sides


def page_of(run: "xr.Dataset", robot: RobotDescription, period: float, look: Look) -> str:
    """HTML with all that it needs: three periods of what repeats itself, else the whole run, in its own time."""
    server = guarded_server(Gate(), 0)
    try:
        scene = server.scene
        scene.world_axes.visible = False
        stage = Stage(scene)
        stage.load(run, robot, period, look)
        place, target = (np.asarray(x) for x in stage.camera("three-quarter"))
        server.initial_camera.position = target + _NEARER * (place - target)
        server.initial_camera.look_at = target
        record = server.get_scene_serializer()
        end = _PERIODS * period if period else stage.course.end
        times = np.linspace(0.0, end, int(np.clip(end * _PICTURES, 2, _MOST)))
        for t in times:
            stage.at(float(t))
            record.insert_sleep(float(times[1] - times[0]))
        return record.as_html()
    finally:
        server.stop()

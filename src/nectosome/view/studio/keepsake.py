"""The scene of a run as one page that turns and plays without a server."""

from typing import TYPE_CHECKING

import numpy as np

from nectosome.io import RobotDescription

from .gate import Gate, guarded_server
from .scene import Look, Stage

if TYPE_CHECKING:
    import xarray as xr

_PICTURES = 20  # a second
_MOST = 600  # pictures
_PERIODS = 3  # of what repeats itself


def page_of(run: "xr.Dataset", robot: RobotDescription, period: float, look: Look) -> str:
    """HTML with all that it needs: three periods of what repeats itself, else the whole run, in its own time."""
    server = guarded_server(Gate(), 0)
    try:
        scene = server.scene
        scene.world_axes.visible = False
        stage = Stage(scene)
        stage.load(run, robot, period, look)
        server.initial_camera.position, server.initial_camera.look_at = stage.camera("three-quarter")
        record = server.get_scene_serializer()
        end = _PERIODS * period if period else stage.course.end
        times = np.linspace(0.0, end, int(np.clip(end * _PICTURES, 2, _MOST)))
        for t in times:
            stage.at(float(t))
            record.insert_sleep(float(times[1] - times[0]))
        return record.as_html()
    finally:
        server.stop()

"""Cameras that were calibrated by known points, places from their pixels, poses of bodies, and gaps in them."""

from .behind import calibrate_behind
from .camera import Camera, Report
from .dlt import calibrate
from .gaps import fill, fill_rotations
from .glass import Glass
from .lens import Lens
from .pose import Pose, pose
from .status import Status
from .triangulate import Places, triangulate

__all__ = [
    "Camera",
    "Glass",
    "Lens",
    "Places",
    "Pose",
    "Report",
    "Status",
    "calibrate",
    "calibrate_behind",
    "fill",
    "fill_rotations",
    "pose",
    "triangulate",
]

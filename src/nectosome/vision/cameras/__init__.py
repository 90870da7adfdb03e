"""Cameras that were calibrated by known points, places from their pixels, poses of bodies, and gaps in them."""

from .calibration import calibrate, calibrate_behind
from .camera import Camera, Glass, Lens, Report
from .gaps import fill, fill_rotations
from .pose import Pose, pose
from .triangulate import Places, Status, triangulate

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

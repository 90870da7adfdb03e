"""Cameras that were calibrated by known points, places from their pixels, poses of bodies, and gaps in them."""

from .calibration import calibrate, calibrate_behind
from .camera import Camera, Glass, Lens, Report
from .gaps import fill, fill_rotations
from .pose import BodyPose, pose
from .triangulate import PlaceStatus, Triangulated, triangulate

__all__ = [
    "BodyPose",
    "Camera",
    "Glass",
    "Lens",
    "PlaceStatus",
    "Report",
    "Triangulated",
    "calibrate",
    "calibrate_behind",
    "fill",
    "fill_rotations",
    "pose",
    "triangulate",
]

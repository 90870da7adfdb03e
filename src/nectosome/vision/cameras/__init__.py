"""Cameras calibrated by known points, triangulation, poses of bodies, and filling of gaps."""

from .calibration import calibrate, calibrate_through_glass
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
    "calibrate_through_glass",
    "fill",
    "fill_rotations",
    "pose",
    "triangulate",
]

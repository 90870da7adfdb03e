"""Cameras calibrated by known points, triangulation, poses of bodies, and filling of gaps."""

from .calibration import calibrate, calibrate_through_glass
from .camera import Camera, Glass, Lens, Report
from .gaps import fill, fill_rotations
from .pose import BodyPose, pose
from .triangulate import PlaceStatus, Triangulated, triangulate

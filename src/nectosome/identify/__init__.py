"""Identification: what measurements say of a model."""

from .alignment import Rigid, align_inliers, align_points
from .gaussian_process import Surface, gaussian_process

__all__ = ["Rigid", "Surface", "align_inliers", "align_points", "gaussian_process"]

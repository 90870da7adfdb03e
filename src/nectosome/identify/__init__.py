"""Identification: what measurements say of a model."""

from .alignment import Rigid, align, align_robustly
from .gaussian_process import Surface, gaussian_process

__all__ = ["Rigid", "Surface", "align", "align_robustly", "gaussian_process"]

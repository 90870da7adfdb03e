"""Measurements: bench files of any kind as recordings with units, and signals made of them."""

from .calibrate import calibrate
from .campaign import Campaign, load_campaign
from .recordings import read, read_all
from .sheet import Sheet, load_sheet

__all__ = ["Campaign", "Sheet", "calibrate", "load_campaign", "load_sheet", "read", "read_all"]

"""From a description to a robot, what can be read of its motion, and what runs it sample by sample or mode by mode."""

from .build import Blueprint, bind, blueprint_of, build, fill
from .mission import Flown, Passed, mission_data, run_mission
from .readings import common_readings, read, reading_of
from .sampled_plant import Commanded

__all__ = [
    "Blueprint",
    "Commanded",
    "Flown",
    "Passed",
    "bind",
    "blueprint_of",
    "build",
    "common_readings",
    "fill",
    "mission_data",
    "read",
    "reading_of",
    "run_mission",
]

"""From a description to a robot, what can be read of its motion, and what runs it sample by sample or mode by mode."""

from .build import Template, bind, build, instantiate, template_of
from .inputs import RobotLike, description_of, robot_of
from .mission import Flown, Passed, mission_data, run_mission
from .readings import common_readings, read, reading_of
from .sampled_plant import SampledPlant

__all__ = [
    "Flown",
    "Passed",
    "RobotLike",
    "SampledPlant",
    "Template",
    "bind",
    "build",
    "common_readings",
    "description_of",
    "instantiate",
    "mission_data",
    "read",
    "reading_of",
    "robot_of",
    "run_mission",
    "template_of",
]

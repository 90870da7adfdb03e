"""From a description to a robot, and what a public function takes for one."""

from .build import Template, bind, build, developed, instantiate, robot_of, template_of
from .inputs import RobotLike, description_of

__all__ = [
    "RobotLike",
    "Template",
    "bind",
    "build",
    "description_of",
    "developed",
    "instantiate",
    "robot_of",
    "template_of",
]

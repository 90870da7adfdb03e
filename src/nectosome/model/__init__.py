"""From a description to a robot, and what a public function takes for one."""

from .build import Template, bind, build, instantiate, robot_of, robot_without_ramps, template_of
from .inputs import RobotLike, description_of

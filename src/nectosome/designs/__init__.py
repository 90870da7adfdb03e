"""Designs: sweeps over quantities of a robot, and searches for its best motion or its shortest mission."""

from .constraints import Constraint, Limit, MotorLine, read_constraint
from .design import BEST, DesignResult, design
from .design_task import DesignTask
from .motion import MotionDesign
from .problem import Problem, load_problem, problem_of, shipped_problem
from .quantities import QUANTITIES
from .schedule import ScheduleDesign
from .shares import gather, sweep_share
from .sweep import sweep
from .uncertain_runs import spread

"""Design problems: what may vary in a robot or a mission, how its motion is judged, and sweeps over quantities."""

from .constraints import Constraint, Limit, MotorLine, read_constraint
from .motion import MotionDesign, Varied
from .problem import Problem, change, dump_design, load_problem, restore_design, shipped_problem
from .quantities import QUANTITIES
from .schedule import ScheduleDesign
from .sweep import sweep

__all__ = [
    "QUANTITIES",
    "Constraint",
    "Limit",
    "MotionDesign",
    "MotorLine",
    "Problem",
    "ScheduleDesign",
    "Varied",
    "change",
    "dump_design",
    "load_problem",
    "read_constraint",
    "restore_design",
    "shipped_problem",
    "sweep",
]

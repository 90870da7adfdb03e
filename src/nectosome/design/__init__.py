"""Design: constrained optimisation of motions from many starts, and sweeps; both survive being killed."""

from nectosome.io.variables import Box, Variable, read_variable

from .composite import ratio_of, young_of
from .constraints import Constraint, Limit, MotorLine, read_constraint
from .evolution import Evolution
from .files import Problem, change, dump_design, load_problem, restore_design, shipped_problem
from .folder import read_design, read_starts
from .gradient import Gradient
from .improve import improve
from .multistart import multistart
from .pareto import Front, front
from .pattern import Pattern
from .problem import MotionDesign
from .quantities import QUANTITIES
from .result import Result, Start
from .schedule import ScheduleDesign
from .solvers import SOLVERS, describe_solver, make_solver
from .sweep import sweep
from .task import Evaluate, Evaluation, Outcome, Solver, Task
from .varied import Varied
from .workers import Workers

__all__ = [
    "QUANTITIES",
    "SOLVERS",
    "Box",
    "Constraint",
    "Evaluate",
    "Evaluation",
    "Evolution",
    "Front",
    "Gradient",
    "Limit",
    "MotionDesign",
    "MotorLine",
    "Outcome",
    "Pattern",
    "Problem",
    "Result",
    "ScheduleDesign",
    "Solver",
    "Start",
    "Task",
    "Variable",
    "Varied",
    "Workers",
    "change",
    "describe_solver",
    "dump_design",
    "front",
    "improve",
    "load_problem",
    "make_solver",
    "multistart",
    "ratio_of",
    "read_constraint",
    "read_design",
    "read_starts",
    "read_variable",
    "restore_design",
    "shipped_problem",
    "sweep",
    "young_of",
]

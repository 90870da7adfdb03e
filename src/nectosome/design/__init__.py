"""Design: constrained minimisation over a box, from many starts, that survives being killed."""

from .evolution import Evolution
from .folder import read_design
from .gradient import Gradient
from .multistart import multistart
from .pareto import Front, front
from .pattern import Pattern
from .result import Result, Start
from .solvers import SOLVERS, describe_solver, make_solver
from .task import Evaluate, Evaluation, Outcome, Solver, Task

__all__ = [
    "SOLVERS",
    "Evaluate",
    "Evaluation",
    "Evolution",
    "Front",
    "Gradient",
    "Outcome",
    "Pattern",
    "Result",
    "Solver",
    "Start",
    "Task",
    "describe_solver",
    "front",
    "make_solver",
    "multistart",
    "read_design",
]

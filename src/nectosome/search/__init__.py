"""Searches for the best: tasks, optimisers, journals, many starts; nothing is lost when one is killed."""

from .evolution import Evolution
from .folder import read_design, read_starts
from .found import Evolved
from .generations import evolve
from .gradient import Gradient
from .improve import improve
from .multistart import multistart
from .outcome import Result, Start
from .pareto import Front, front
from .pattern import Pattern
from .populations import CmaEs, DifferentialEvolution, Evolver, Genetic, ParetoFront
from .processes import Workers
from .solvers import SOLVERS, describe_solver, make_solver
from .task import Evaluate, Evaluation, Outcome, Solver, Task

__all__ = [
    "SOLVERS",
    "CmaEs",
    "DifferentialEvolution",
    "Evaluate",
    "Evaluation",
    "Evolution",
    "Evolved",
    "Evolver",
    "Front",
    "Genetic",
    "Gradient",
    "Outcome",
    "ParetoFront",
    "Pattern",
    "Result",
    "Solver",
    "Start",
    "Task",
    "Workers",
    "describe_solver",
    "evolve",
    "front",
    "improve",
    "make_solver",
    "multistart",
    "read_design",
    "read_starts",
]

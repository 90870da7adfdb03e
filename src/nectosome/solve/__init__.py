"""Solvers: simulate through time, static equilibrium, steady motion."""

from .equilibrium import Equilibrium, equilibrium
from .results import Results, Run, Trajectory, prepare_results
from .settle import Settled, settled
from .simulate import simulate
from .static import static
from .steady import Steady, steady
from .symmetry import Symmetry, find_symmetry

__all__ = [
    "Equilibrium",
    "Results",
    "Run",
    "Settled",
    "Steady",
    "Symmetry",
    "Trajectory",
    "equilibrium",
    "find_symmetry",
    "prepare_results",
    "settled",
    "simulate",
    "static",
    "steady",
]

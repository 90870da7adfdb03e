"""Solvers: simulate through time, static equilibrium, steady and periodic motion."""

from .equilibrium import Equilibrium, equilibrium
from .periodic import Periodic, periodic
from .results import Results, Run, Trajectory, prepare_results
from .screw import Screw, screw_of
from .settle import Settled, settled
from .simulate import simulate
from .static import static
from .steady import Steady, steady
from .symmetry import Symmetry, find_symmetry

__all__ = [
    "Equilibrium",
    "Periodic",
    "Results",
    "Run",
    "Screw",
    "Settled",
    "Steady",
    "Symmetry",
    "Trajectory",
    "equilibrium",
    "find_symmetry",
    "periodic",
    "prepare_results",
    "screw_of",
    "settled",
    "simulate",
    "static",
    "steady",
]

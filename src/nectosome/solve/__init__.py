"""Solvers: simulate through time, static equilibrium, steady motion."""

from .dataset import Run, Trajectory, prepare_dataset
from .equilibrium import Equilibrium, equilibrium
from .settle import Settled, settled
from .simulate import simulate
from .static import static
from .steady import Steady, steady
from .symmetry import Symmetry, find_symmetry

__all__ = [
    "Equilibrium",
    "Run",
    "Settled",
    "Steady",
    "Symmetry",
    "Trajectory",
    "equilibrium",
    "find_symmetry",
    "prepare_dataset",
    "settled",
    "simulate",
    "static",
    "steady",
]

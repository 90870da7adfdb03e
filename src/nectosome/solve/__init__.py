"""Solvers: simulate through time, static equilibrium."""

from .dataset import Run, Trajectory, prepare_dataset
from .simulate import simulate
from .static import static

__all__ = ["Run", "Trajectory", "prepare_dataset", "simulate", "static"]

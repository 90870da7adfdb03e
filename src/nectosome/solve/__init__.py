"""Solvers: simulate through time, static equilibrium."""

from .dataset import Run, Trajectory
from .simulate import simulate
from .static import static

__all__ = ["Run", "Trajectory", "simulate", "static"]

"""Solvers: simulate."""

from .dataset import Run, Trajectory
from .simulate import simulate

__all__ = ["Run", "Trajectory", "simulate"]

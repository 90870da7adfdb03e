"""Solvers: time integration, static equilibrium, steady and periodic motion."""

from .cycle_means import CycleMeans, cycle_means, mean_data, means_of, prepare_means
from .equilibrium import Equilibrium, equilibrium
from .fixed_step import fixed_step
from .load_stepping import load_stepping
from .periodic import CyclePath, Periodic, periodic
from .regime import Regime, regime_of
from .results import (
    Results,
    Run,
    Trajectory,
    attributes_of,
    diagnose_all,
    drive_limits,
    overloaded,
    prepare_results,
    results_of,
)
from .screw import Screw, screw_of
from .simulate import simulate
from .static import Static, frozen_drives, static
from .steady import Steady, steady
from .symmetry import Symmetry, find_symmetry

__all__ = [
    "CycleMeans",
    "CyclePath",
    "Equilibrium",
    "Periodic",
    "Regime",
    "Results",
    "Run",
    "Screw",
    "Static",
    "Steady",
    "Symmetry",
    "Trajectory",
    "attributes_of",
    "cycle_means",
    "diagnose_all",
    "drive_limits",
    "equilibrium",
    "find_symmetry",
    "fixed_step",
    "frozen_drives",
    "load_stepping",
    "mean_data",
    "means_of",
    "overloaded",
    "periodic",
    "prepare_means",
    "prepare_results",
    "regime_of",
    "results_of",
    "screw_of",
    "simulate",
    "static",
    "steady",
]

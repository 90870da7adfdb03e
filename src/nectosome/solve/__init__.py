"""Solvers: simulate through time, static equilibrium, steady and periodic motion."""

from .cycle_means import CycleMeans, cycle_means, mean_data, means_of, prepare_means
from .equilibrium import Equilibrium, equilibrium
from .fixed_step import pace
from .periodic import Course, Periodic, periodic
from .regime import Settled, settled
from .resting import Resting, held, resting
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
from .static import static
from .steady import Steady, steady
from .symmetry import Symmetry, find_symmetry

__all__ = [
    "Course",
    "CycleMeans",
    "Equilibrium",
    "Periodic",
    "Resting",
    "Results",
    "Run",
    "Screw",
    "Settled",
    "Steady",
    "Symmetry",
    "Trajectory",
    "attributes_of",
    "cycle_means",
    "diagnose_all",
    "drive_limits",
    "equilibrium",
    "find_symmetry",
    "held",
    "mean_data",
    "means_of",
    "overloaded",
    "pace",
    "periodic",
    "prepare_means",
    "prepare_results",
    "resting",
    "results_of",
    "screw_of",
    "settled",
    "simulate",
    "static",
    "steady",
]

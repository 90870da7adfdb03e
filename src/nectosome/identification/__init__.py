"""Identification: what measurements say of a model. `linear`, `surge` and `posterior` need JAX: import them by name."""

from .fits.errors import Errors, errors_of
from .fits.identifiability import Helpful, Identifiability, Interval, identifiability, most_helpful
from .fits.intervals import Bootstrap, Profile, bootstrap, profile
from .fits.misfit import Fit, Misfit
from .sim2real.alignment import RigidMap, align_inliers, align_points
from .sim2real.conditions import Experiments, ParameterEstimate
from .sim2real.corrected_data import corrected_data
from .sim2real.corrected_grid import CorrectedGrid, correct_grid
from .sim2real.gaussian_process import Surface, Term, gaussian_process
from .sim2real.grids import GridTable, table_of
from .sim2real.method import METHODS, Corrected, SimToReal, leave_one_out
from .sim2real.next_experiment import Aim, Next, next_experiments, uniform_plan
from .sim2real.observe import Observed, experiments_of, observe

__all__ = [
    "METHODS",
    "Aim",
    "Bootstrap",
    "Corrected",
    "CorrectedGrid",
    "Errors",
    "Experiments",
    "Fit",
    "GridTable",
    "Helpful",
    "Identifiability",
    "Interval",
    "Misfit",
    "Next",
    "Observed",
    "ParameterEstimate",
    "Profile",
    "RigidMap",
    "SimToReal",
    "Surface",
    "Term",
    "align_inliers",
    "align_points",
    "bootstrap",
    "correct_grid",
    "corrected_data",
    "errors_of",
    "experiments_of",
    "gaussian_process",
    "identifiability",
    "leave_one_out",
    "most_helpful",
    "next_experiments",
    "observe",
    "profile",
    "table_of",
    "uniform_plan",
]

"""Identification: what measurements say of a model. `linear`, `surge` and `posterior` need JAX: import them by name."""

from .alignment import Rigid, align_inliers, align_points
from .correct import CorrectedGrid, correct_grid
from .evolve import evolve
from .evolved import Evolved
from .evolvers import CmaEs, DifferentialEvolution, Evolver, Genetic, ParetoFront
from .experiments import Experiments, Told
from .gaussian_process import Surface, Term, gaussian_process
from .identifiable import Helpful, Identifiability, Interval, identifiability, most_helpful
from .intervals import Bootstrap, Profile, bootstrap, profile
from .metrics import Errors, errors_of
from .misfit import Fit, Misfit
from .observe import Observed, experiments_of, observe
from .plan import Aim, Next, next_experiments, uniform_plan
from .results import corrected_data
from .sim2real import METHODS, Corrected, SimToReal, leave_one_out
from .table import Table, table_of

__all__ = [
    "METHODS",
    "Aim",
    "Bootstrap",
    "CmaEs",
    "Corrected",
    "CorrectedGrid",
    "DifferentialEvolution",
    "Errors",
    "Evolved",
    "Evolver",
    "Experiments",
    "Fit",
    "Genetic",
    "Helpful",
    "Identifiability",
    "Interval",
    "Misfit",
    "Next",
    "Observed",
    "ParetoFront",
    "Profile",
    "Rigid",
    "SimToReal",
    "Surface",
    "Table",
    "Term",
    "Told",
    "align_inliers",
    "align_points",
    "bootstrap",
    "correct_grid",
    "corrected_data",
    "errors_of",
    "evolve",
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

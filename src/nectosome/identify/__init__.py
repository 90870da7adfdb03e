"""Identification: what measurements say of a model. What needs JAX, `linear` and `surge`, is not imported here."""

from .alignment import Rigid, align_inliers, align_points
from .experiments import Experiments, Told
from .gaussian_process import Surface, Term, gaussian_process
from .metrics import Errors, errors_of
from .observe import Observed, experiments_of, observe
from .plan import Aim, Next, next_experiments, uniform_plan
from .results import corrected_data
from .sim2real import METHODS, Corrected, SimToReal, leave_one_out
from .table import Table, table_of

__all__ = [
    "METHODS",
    "Aim",
    "Corrected",
    "Errors",
    "Experiments",
    "Next",
    "Observed",
    "Rigid",
    "SimToReal",
    "Surface",
    "Table",
    "Term",
    "Told",
    "align_inliers",
    "align_points",
    "corrected_data",
    "errors_of",
    "experiments_of",
    "gaussian_process",
    "leave_one_out",
    "next_experiments",
    "observe",
    "table_of",
    "uniform_plan",
]

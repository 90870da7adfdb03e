"""Identification: unknown quantities of robots and models from recordings, and simulated grids corrected by them."""

from .bollard_tables import ThrusterFit, identify_thruster
from .fits.curves import CurveFit, fit
from .fits.errors import Errors, errors_of
from .fits.identifiability import Helpful, Identifiability, Interval, identifiability, most_helpful
from .fits.intervals import Bootstrap, Profile, bootstrap, profile
from .fits.misfit import Fit, Misfit
from .gait.files import identify_gait
from .gait.fit import GaitResult
from .hysteresis.files import HysteresisFit, identify_hysteresis
from .recordings import recordings_of
from .robot.fit import RobotFit, identify
from .robot.fit_progress import FitSoFar, FitStoppedError
from .sim2real.correct import CorrectedGrid, correct, corrected_data
from .sim2real.gaussian_process import Surface, Term, gaussian_process
from .sim2real.grids import GridTable, table_of
from .sim2real.method import METHODS, Corrected, SimToReal, leave_one_out
from .sim2real.next_experiment import Aim, Next, next_experiments, uniform_plan
from .sim2real.observe import Experiments, Observed, ParameterEstimate, experiments_of, observe
from .sim2real.residuals import RigidMap, align_inliers, align_points
from .surge.files import SurgeFit, identify_surge

r"""What errors of time steps do to parameters that were fitted.

Residuals of steps a hundred times as exact differ by e [standard errors]. With the residuals' derivatives J by places
in the ranges, these move parameters to first order by

$$ \Delta u = -(J^T J + 12 I)^{-1} J^T e $$

where 12 is the information of a range alone (`identifiability`), and by $|Q^T e|$ standard errors of theirs, J = Q R.
"""

import copy
from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.units import DIMENSIONS

from ..fits.identifiability import RANGE, Identifiability
from .misfit import RobotMisfit

_TIGHTER = 1e-2  # of the tolerance, of steps whose errors show those of longer ones
_MOST = 2  # times that the steps of a fit become shorter
_MOVED = 0.3  # standard errors of what is identified, by which the errors of steps may move parameters
UNKNOWN = "intervals may be too narrow: time steps that would show the errors of those taken did not end"
_WAY_OUT = "Fit shorter recordings, or give larger standard errors"


class StepErrors(NamedTuple):
    """How far more exact time steps move parameters; NaN where these did not end."""

    moves: Float[np.ndarray, "p"]  # of places in the ranges
    size: float  # in standard errors of what is identified

    @property
    def matter(self) -> bool:
        """Whether they move parameters by more than data leave unknown."""
        return self.size > _MOVED


def step_errors(problem: RobotMisfit, theta: Float[np.ndarray, "p"], errors: Float[np.ndarray, "k"]) -> StepErrors:
    """Errors of the steps that a fit has taken, with a standard error of each column; shapes at rest have none."""
    if all(trial.rows is not None for trial in problem.trials):
        return StepErrors(np.zeros(theta.size), 0.0)
    exact = copy.copy(problem)
    exact.rtol *= _TIGHTER
    misfit, u = problem.misfit(errors), problem.box.places(theta)
    error = exact.misfit(errors).at(u[None])[0] - misfit.at(u[None])[0]
    if not np.isfinite(error).all():
        return StepErrors(np.full(theta.size, np.nan), np.nan)
    by = misfit.derivatives(u)
    wide = np.concatenate([by, np.sqrt(RANGE) * np.eye(theta.size)])
    moves = -np.linalg.lstsq(wide, np.concatenate([error, np.zeros(theta.size)]))[0]
    return StepErrors(moves, float(np.linalg.norm(np.linalg.qr(by)[0].T @ error)))


def shorter(problem: RobotMisfit, found: StepErrors, made: int) -> bool:
    """Take shorter steps in a fit whose result depends on those that it took, and were shortened so often before."""
    if not found.matter or made == _MOST:
        return False
    problem.rtol *= _TIGHTER
    return True


def moved_by_steps(
    problem: RobotMisfit, theta: Float[np.ndarray, "p"], found: StepErrors, known: Identifiability
) -> list[str]:
    """A sentence where a fit still depends on its steps: what more exact ones move by how much beside its interval."""
    if np.isnan(found.size):
        return [UNKNOWN]
    if not (found.matter and np.linalg.norm(known.root @ found.moves) > _MOVED):
        return []
    shares = np.abs(found.moves) / known.errors
    moved = problem.box.values(np.clip(problem.box.places(theta) + found.moves, 0.0, 1.0)) - theta
    parts, intervals = list[str](), known.intervals()
    for k in np.flatnonzero(shares >= min(_MOVED, shares.max())):
        variable, interval = problem.variables[k], intervals[k]
        by = f"{moved[k]:.2g} {DIMENSIONS[variable.dimension].unit}".strip()
        half = 0.5 * (interval.high - interval.low)
        parts.append(f"{variable.name} by {by} (half of its 95 % interval: {half:.2g})")
    return [f"the shortest time steps are too long for these data: more exact ones move {', '.join(parts)}. {_WAY_OUT}"]

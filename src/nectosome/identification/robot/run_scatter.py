r"""What recordings tell apart from one another: intervals that hold more than their noise.

A clamp, a temperature, what a model leaves out at another amplitude: all that differs between recordings moves what
they tell of a parameter, and is in no residual's noise. Each of G recordings is left out in turn; the others put the
parameters, to first order from the fit, at places $u_{-g}$ (jackknife, Tukey 1958; its bias for few groups is towards
wide, MacKinnon and White 1985, HC3):

$$ \mathrm{var}\,u = \frac{G - 1}{G} \sum_g (u_{-g} - \overline{u_{-}})^2, \quad
u_{-g} - u = -(J_{-g}^T J_{-g} + 12 I)^{-1} J_{-g}^T r_{-g} $$

with residuals r of all but g, their derivatives J and the information of a range alone (`identifiability`). Student's t
makes a 95 % interval of it, which is taken where it is wider than that of the noise. Recordings that tell more of a
parameter decide it, so that it has fewer degrees of freedom than G - 1 (Satterthwaite 1946), by the weights
$a_g = [F^{-1} F_g]_{kk}$ of the information:

$$ \nu = (\textstyle\sum_g a_g^2)^2 / \sum_g a_g^4 - 1 $$

What a model leaves out is the same in repeats: where conditions differ by more than their repeats (analysis of
variance, Fisher's F, 5 %) all recordings of one are left out together, and G counts conditions.
"""

from collections.abc import Hashable, Sequence

import numpy as np
from jaxtyping import Bool, Float
from scipy.special import fdtri, stdtrit

from ..fits.errors import SIDES
from ..fits.identifiability import RANGE, Identifiability
from .misfit import RobotMisfit

LEAST = 3  # recordings, or conditions, that tell a scatter
NEEDED = f"Intervals hold that where {LEAST} recordings or more tell it: fit repeats and other conditions, too"


def widened_by_scatter(
    problem: RobotMisfit, theta: Float[np.ndarray, "p"], errors: Float[np.ndarray, "k"], known: Identifiability
) -> tuple[Identifiability, list[str]]:
    """What is known, with intervals that hold the scatter between recordings, and a sentence where that is wider.

    `errors` are the standard errors of columns by which was fitted. Fewer than three recordings tell nothing; those of
    one row each are readings, which scatter by the noise.
    """
    misfit, u, trials = problem.misfit(errors), problem.box.places(theta), problem.trials
    if len(trials) < LEAST or all(trial.time.size == 1 for trial in trials):
        return known, []
    left, by = misfit.at(u[None])[0], misfit.derivatives(u)
    if problem.bend is not None:  # outliers pull at the fit by the bend, wherever they are
        by = by * (np.abs(left) <= problem.bend)[:, None]
        left = np.clip(left, -problem.bend, problem.bend)
    of = np.repeat(np.arange(len(trials)), [np.isfinite(trial.measured).sum() for trial in trials])
    each = [trial.conditions for trial in trials]
    n, m = len(trials), len({*each})
    moved, free = _moved(left, by, of, range(n)), _freedom(by, of, range(n))
    spread, what = _spread(moved), np.full(theta.size, f"{n} recordings")
    if LEAST <= m < n:
        systematic = _differ(moved, each)
        spread = np.where(systematic, _spread(_moved(left, by, of, each)), spread)
        what, free = np.where(systematic, f"{m} conditions", what), np.where(systematic, _freedom(by, of, each), free)
    shared = np.array(problem.shared)
    free = np.where(shared, free, n - 1)  # what is one recording's own moves with what all have
    wider = np.maximum(spread / known.spreads * stdtrit(free, 0.975) / SIDES, 1.0)
    said = list[str]()
    told = (wider > 1) & shared
    for one in dict.fromkeys(what[told].tolist()):
        shares = (f"{problem.box.names[k]} {wider[k]:.2g}" for k in np.flatnonzero((what == one) & told))
        said.append(f"by the scatter between {one}: intervals of {', '.join(shares)} times as wide as by noise alone")
    return known.widened(wider), said


def _moved(
    left: Float[np.ndarray, "r"], by: Float[np.ndarray, "r p"], of: np.ndarray, groups: Sequence[Hashable]
) -> Float[np.ndarray, "g p"]:
    """How far places move where recordings of each group are left out in turn."""
    moved = list[np.ndarray]()
    for name in dict.fromkeys(groups):
        kept = np.array([group != name for group in groups])[of]
        rows = np.concatenate([by[kept], np.sqrt(RANGE) * np.eye(by.shape[1])])
        moved.append(-np.linalg.lstsq(rows, np.concatenate([left[kept], np.zeros(by.shape[1])]))[0])
    return np.array(moved)


def _spread(moved: Float[np.ndarray, "g p"]) -> Float[np.ndarray, "p"]:
    """Standard errors of places by how far they move."""
    n = len(moved)
    return np.sqrt((n - 1) / n * np.sum((moved - np.mean(moved, axis=0)) ** 2, axis=0))


def _freedom(by: Float[np.ndarray, "r p"], of: np.ndarray, groups: Sequence[Hashable]) -> Float[np.ndarray, "p"]:
    """Degrees of freedom of the scatter between groups of recordings, from 1 on."""
    each = [by[np.array([group == name for group in groups])[of]] for name in dict.fromkeys(groups)]
    information = np.array([rows.T @ rows for rows in each])
    whole = information.sum(axis=0) + RANGE * np.eye(by.shape[1])
    squares = np.diagonal(np.linalg.solve(whole, information), axis1=1, axis2=2) ** 2
    return np.clip(squares.sum(axis=0) ** 2 / np.sum(squares**2, axis=0) - 1, 1.0, len(each) - 1.0)


def _differ(moved: Float[np.ndarray, "n p"], groups: Sequence[Hashable]) -> Bool[np.ndarray, "p"]:
    """Of which parameters groups of recordings tell more different values than recordings within them."""
    names = [*dict.fromkeys(groups)]
    which = np.array([names.index(group) for group in groups])
    means = np.array([moved[which == k].mean(axis=0) for k in range(len(names))])
    between = np.sum((means[which] - moved.mean(axis=0)) ** 2, axis=0) / (len(names) - 1)
    within = np.sum((moved - means[which]) ** 2, axis=0) / (len(moved) - len(names))
    return between > float(fdtri(len(names) - 1, len(moved) - len(names), 0.95)) * within

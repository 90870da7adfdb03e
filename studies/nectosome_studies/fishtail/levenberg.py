"""Levenberg-Marquardt as Xiong et al. 2025 print it for the fishtail, beside the library's variable projection.

Used by the benchmarks and by the tests of `identification`.
"""

from typing import NamedTuple

import numpy as np
from jaxtyping import Float

from nectosome.identification.fits.misfit import Misfit
from nectosome.identification.hysteresis.fit import HysteresisModel, Identified
from nectosome.units import InputError

_DAMPING = 1e-2  # at first, of the mean of the diagonal of J^T J
_SETTLED = 1e-12  # change of the sum of squares, as a share of it


class Descent(NamedTuple):
    """Where it ended."""

    theta: Float[np.ndarray, "n"]
    chi2: float
    iterations: int
    settled: bool  # whether the sum of squares stayed as it was; else the iterations were used up


def levenberg(misfit: Misfit, theta: Float[np.ndarray, "n"], iterations: int = 200) -> Descent:
    r"""Least squares from theta on by $\Delta u = -(J^T J + \lambda I)^{-1} J^T r$ (Xiong et al. 2025, section 3.2).

    A step that makes the sum of squares smaller is taken and the damping divided by ten; else it is multiplied by ten,
    as for one that leaves the ranges. It ends when the sum of squares changes by less than 1e-12 of it, or
    the damping has become so large that no step is left. u are places in the ranges, on their scales.

    Raises InputError where theta is outside of the ranges, or residuals are NaN or infinite there.
    """
    u = misfit.places(theta)
    r = misfit.at(u[None])[0]
    chi2, damping = float(r @ r), 0.0
    if not np.isfinite(chi2):
        raise InputError(f"the residuals are NaN or infinite at {misfit.ranges.text(misfit.ranges.values(u))}.")
    for done in range(iterations):
        J = misfit.derivatives(u)
        A, b = J.T @ J, J.T @ r
        if done == 0:
            damping = _DAMPING * float(np.mean(np.diagonal(A)))
        while True:
            step = -np.linalg.solve(A + damping * np.eye(len(u)), b)
            if np.abs(step).max() < 1e-14:
                return Descent(misfit.ranges.values(u), chi2, done, True)
            after = u + step
            inside = bool(np.all((after >= 0) & (after <= 1)))
            tried = misfit.at(after[None])[0] if inside else r
            if inside and float(tried @ tried) < chi2:
                break
            damping *= 10.0
        before, u, r, damping = chi2, after, tried, 0.1 * damping
        chi2 = float(r @ r)
        if before - chi2 <= _SETTLED * before:
            return Descent(misfit.ranges.values(u), chi2, done + 1, True)
    return Descent(misfit.ranges.values(u), chi2, iterations, False)


def identify_as_printed(model: HysteresisModel, start: Float[np.ndarray, "n"] | None = None) -> Identified:
    """Fit of all parameters of the hysteresis model at once (Xiong et al. 2025, section 3.2); slopes start alike.

    `start` as in `fit_hysteresis`, which finds the same with less care about where it starts.
    """
    first = model.first_guess() if start is None else np.asarray(start, dtype=float)
    gain = 4 * model.gain
    weights = np.full(len(model.thresholds) + 1, 0.25 * gain)
    ended = levenberg(model.problem.whole(gain), np.concatenate([first, weights]))
    warnings = () if ended.settled else (f"the sum of squares still changed after {ended.iterations} iterations",)
    return model.identified(ended.theta[: len(first)], ended.theta[len(first) :], ended.chi2, warnings)

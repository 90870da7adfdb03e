"""Dead time of an actuator, from a command to its effect: how long it may be, and a warning where it was left out."""

from collections.abc import Collection, Sequence

import numpy as np
from jaxtyping import Float

from ..fits.separable import Separable
from .trials import PressureTrial

NAME = "dead_time"
SAMPLES = 400  # that it may be at most
_LONGEST, _SHARE = 0.5, 0.1  # at most: s, of the shortest recording
_SURE = 5.0  # standard errors
_MOST = 0.999  # correlation of neighbouring residuals that counts


def longest(trials: Sequence[PressureTrial]) -> float:
    """Largest dead time that is looked for [s]."""
    return min(_LONGEST, *(min(SAMPLES, _SHARE * len(trial.pressure)) * trial.dt for trial in trials))


def missed(
    problem: Separable, theta: Float[np.ndarray, "n"], place: int, error: float, fixed: Collection[str]
) -> list[str]:
    r"""Warning that a problem with a dead time, at a place of theta, fits better; [] where it hardly does.

    `theta` is the best one for a dead time of 0, `error` the standard error of its residuals [m]. To first order a dead
    time lowers their sum of squares by $(r^T q)^2 / q^T q$, with the residuals r and that part of their derivatives by
    it, q, that no other parameter has. Only where that is significant it is fitted. Residuals of correlation c with
    their neighbours count as those of an error $\sqrt{(1 + c)/(1 - c)}$ times as large.
    """
    at = problem.projected()
    u = at.places(theta)
    r, by = at.at(u[None])[0], at.derivatives(u)
    q, others = by[:, place], np.delete(by, place, axis=1)
    q = q - others @ np.linalg.lstsq(others, q)[0]
    alike = np.clip(r[1:] @ r[:-1] / (r @ r), 0.0, _MOST) if r.any() else 0.0
    error = error * np.sqrt((1 + alike) / (1 - alike))
    if -float(r @ q) <= _SURE * error * np.linalg.norm(q):
        return []
    found = problem.fit(theta, fixed)
    if found.chi2 >= float(r @ r) - (_SURE * error) ** 2:
        return []
    noise, before = (1e3 * float(np.sqrt(chi2 / len(r))) for chi2 in (found.chi2, r @ r))
    better = f"a dead time of {1e3 * found.theta[place]:.3g} ms would fit better"
    residuals = f"residuals of {noise:.4g} mm, not {before:.4g} mm"
    slow = f"{problem.ranges.names[0]} would be {found.theta[0]:.4g} rad/s, not {theta[0]:.4g} rad/s"
    return [f"{better} ({residuals}), and {slow}: fit it too (--dead-time)"]

r"""Residuals that look like a clock that is late, where no shift is free, or one that runs fast or slow.

Readings that are late by $\tau$ leave residuals along the readings' own rates. What of these rates the free parameters
cannot take, $s = (1 - J J^+)\,\partial r/\partial \tau$, is regressed on the residuals r (the score test of Rao 1948,
Proc. Cambridge Phil. Soc. 44, 50, for a parameter that was left out):

$$ \hat\tau = -\frac{s^T r}{s^T s} $$

Where this is not chance, the fit is made again with the shifts free. A shift that is then further from 0 than chance
puts it, by what the residuals of that fit are and how they are correlated, is told. Chance is one in a thousand.

A clock that is fast by the share $\rho$ reads t where the robot's own time is $(1 - \rho) t$: it leaves residuals along
$t\,\partial r/\partial\tau$. As $\rho$ is small, the regression is its estimate, beside any lateness.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.special import chdtri

from nectosome.description.variables import Variable
from nectosome.measure.signals.noise import correlation_time
from nectosome.units import InputError, show_quantity

from ..fits.errors import SIDES
from ..fits.identifiability import identifiability
from .misfit import RobotMisfit
from .starts_and_shifts import SHIFT
from .trials import RobotTrial

_CHANCE = 1e-3  # of a warning, with a clock that is right
_CANDIDATE = 0.05  # the same, of trying: where much else is wrong as well, the first regression is rough
_LEAST = 0.01  # of the time between samples: less is how exactly a motion is computed
_WIDE, _SAMPLES = 3.0, 5  # range of a shift: times its first estimate, and samples
_SHARE = 0.25  # of a recording, the most that a shift may be
_COARSE = 1e-3  # gain of chi2 by the last step
_NAMED = 3  # recordings in a sentence


class _Slopes(NamedTuple):
    """Residuals, and their derivatives by the parameters, by how late each trial is, and by the rate of its clock."""

    residuals: Float[np.ndarray, "r"]
    parameters: Float[np.ndarray, "r p"]
    lateness: Float[np.ndarray, "r i"]
    rates: Float[np.ndarray, "r i"]


def late_clocks(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    errors: Float[np.ndarray, "k"],
    found: Sequence[Variable],
) -> list[str]:
    """A sentence where readings seem late or early, by how much, and how to free that.

    `errors` are standard errors of the columns, `found` the robot's own variables. Nothing of lateness where a shift is
    free, or no fit with shifts can be made, or a clock that runs fast says more; nothing where rows are shapes at rest.
    """
    if any(trial.rows is not None for trial in problem.trials):
        return []
    slopes = _slopes(problem, theta, errors)
    if fast := _fast_clocks(problem, slopes):
        return [fast]
    known = [trial.shift for trial in problem.trials if not isinstance(trial.shift, Variable)]
    if len(known) < len(problem.trials):
        return []
    first = _first_estimates(problem, slopes)
    if first is None:
        return []
    wide = [_widened(*each) for each in zip(problem.trials, known, first, strict=True)]
    free = RobotMisfit(wide, found, problem.compared, problem.bend)
    names = free.box.names
    own = dict(zip(problem.box.names, theta, strict=True))
    own |= {trial.shift.name: s + x for trial, s, x in zip(wide, known, first, strict=True)}  # pyright: ignore
    try:
        best = free.misfit(errors).fit(np.array([own[name] for name in names]), gain=_COARSE).theta
        left = free.misfit(errors).at(free.box.places(best)[None])[0]
        tau = max(correlation_time(row) for row in _rows(free, left))
        scale = np.sqrt(tau * left @ left / max(left.size - len(names), 1))
        spread = identifiability(free.misfit(errors * scale), best)
    except InputError:
        return []
    said = []
    for trial, s in zip(wide, known, strict=True):
        k = names.index(trial.shift.name)  # pyright: ignore
        low, high, below, above = spread.intervals()[k]
        error, by = (high - low) / (2 * SIDES), float(best[k]) - s
        seen = below and above and abs(by) > _LEAST * float(np.median(np.diff(trial.time)))
        if seen and by**2 > chdtri(1, _CHANCE / len(wide)) * error**2:
            said.append((abs(by), _said(trial.name, by, low - s, high - s)))
    if not said:
        return []
    said.sort(reverse=True)
    more = f" and {len(said) - _NAMED} more" if len(said) > _NAMED else ""
    span = _round_up(2 * said[0][0])
    return [
        f"residuals look as if the clock of the readings were wrong: {', '.join(words for _, words in said[:_NAMED])}"
        f"{more}. If so, the parameters are wrong too. Let the fit find it: shift: -{span}..{span} s of a recording in "
        f"the campaign, or --shift=-{span}..{span}s of all"
    ]


def _said(name: str, by: float, low: float, high: float) -> str:
    ends = sorted((abs(low), abs(high)))
    shown, *sides = (show_quantity(x, "time") for x in (abs(by), *ends))
    return f"{name} {'late' if by > 0 else 'early'} by {shown} (95 %: {sides[0]} to {sides[1]})"


def _first_estimates(problem: RobotMisfit, slopes: _Slopes) -> Float[np.ndarray, "i"] | None:
    """How late each trial seems to first order [s]; None where that is chance."""
    r, J, S, _ = slopes
    S = _beyond(J, S)
    found = -np.linalg.lstsq(S, r, rcond=None)[0]
    left = r + S @ found
    score = (r @ r - left @ left) / _variance(problem, left, J.shape[1] + found.size)
    return found if score > chdtri(found.size, _CANDIDATE) else None


def _fast_clocks(problem: RobotMisfit, slopes: _Slopes) -> str:
    """A sentence where clocks seem to run fast or slow, and that says more of the residuals than lateness; else ""."""
    r, J, S, R = slopes
    each = np.array(
        [np.linalg.norm(r + A @ -np.linalg.lstsq(A, r, rcond=None)[0]) for A in (_beyond(J, S), _beyond(J, R))]
    )
    both = np.hstack([J, S])
    R, r = _beyond(both, R), _beyond(both, r[:, None])[:, 0]
    rates = -np.linalg.lstsq(R, r, rcond=None)[0]
    left = r + R @ rates
    spread = np.sqrt(_variance(problem, left, both.shape[1] + rates.size) * np.diag(np.linalg.pinv(R.T @ R)))
    said = []
    for trial, rate, se in zip(problem.trials, rates, spread, strict=True):
        seen = abs(rate) * float(trial.time[-1]) > _LEAST * float(np.median(np.diff(trial.time)))
        if seen and rate**2 > chdtri(1, _CHANCE / rates.size) * se**2:
            ends = sorted(100 * abs(rate + side * SIDES * se) for side in (-1, 1))
            way = "fast" if rate > 0 else "slow"
            words = f"{trial.name} {way} by {100 * abs(rate):.2g} % (95 %: {ends[0]:.2g} to {ends[1]:.2g} %)"
            said.append((abs(rate), words))
    if not said or each[1] >= each[0]:
        return ""
    said.sort(reverse=True)
    more = f" and {len(said) - _NAMED} more" if len(said) > _NAMED else ""
    listed = f"{', '.join(words for _, words in said[:_NAMED])}{more}"
    return (
        f"residuals look as if the clock of the readings ran fast or slow: {listed}. If so, the parameters are wrong "
        "too. Correct its times: a camera's 29.97 frames/s taken for 30 makes it slow by 0.1 %, and time: "
        "{rate: 29.97 Hz} in its sheet mends that"
    )


def _slopes(problem: RobotMisfit, theta: Float[np.ndarray, "p"], errors: Float[np.ndarray, "k"]) -> _Slopes:
    misfit = problem.misfit(errors)
    u = problem.box.places(theta)
    r, J = misfit.at(u[None])[0], misfit.derivatives(u)
    S, R = np.zeros((2, r.size, len(problem.trials)))
    begin = 0
    for i, trial in enumerate(problem.trials):
        there, by_shift = np.isfinite(trial.measured), problem.by_shift(i, theta) / errors[:, None]
        rows = slice(begin, begin + int(there.sum()))
        S[rows, i], R[rows, i] = by_shift[there], (by_shift * trial.time)[there]
        begin = rows.stop
    return _Slopes(r, J, S, R)


def _beyond(taken: Float[np.ndarray, "r k"], S: Float[np.ndarray, "r i"]) -> Float[np.ndarray, "r i"]:
    """What of the columns of S those of `taken` cannot take."""
    return S - taken @ np.linalg.lstsq(taken, S, rcond=None)[0]


def _variance(problem: RobotMisfit, left: Float[np.ndarray, "r"], parameters: int) -> float:
    """Variance of a residual, times the samples over which residuals are correlated."""
    tau = max(correlation_time(row) for row in _rows(problem, left))
    return float(tau * left @ left / max(left.size - parameters, 1))


def _rows(problem: RobotMisfit, residuals: Float[np.ndarray, "r"]) -> list[Float[np.ndarray, "_"]]:
    """Residuals of each column of each trial."""
    sizes = [int(np.isfinite(row).sum()) for trial in problem.trials for row in trial.measured]
    return [row for row in np.split(residuals, np.cumsum(sizes)[:-1]) if row.size > 1]


def _widened(trial: RobotTrial, shift: float, first: float) -> RobotTrial:
    """A trial whose shift is free."""
    step = float(np.median(np.diff(trial.time)))
    wide = min(_WIDE * abs(first) + _SAMPLES * step, _SHARE * float(trial.time[-1]))
    return trial.shifted_by(Variable(f"{SHIFT} of {trial.name}", shift - wide, shift + wide, False, "time"))


def _round_up(x: float) -> str:
    """One digit, at least x."""
    unit = 10.0 ** np.floor(np.log10(x))
    return f"{unit * np.ceil(x / unit):.0e}" if x < 1e-4 else f"{unit * np.ceil(x / unit):g}"

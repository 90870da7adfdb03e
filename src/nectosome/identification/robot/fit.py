r"""What is unknown of a robot, from recordings of it: least squares of its simulated motion, by exact slopes.

$$ \min_\theta \sum_{ck} \left( \frac{y_c(t_k; \theta) - y_{ck}}{\sigma_c} \right)^2 $$

over columns c and samples k. Standard errors that are not given are those that the fit itself leaves. Intervals count
residuals that hang together for $\tau$ samples as so many fewer.
"""

import json
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from nectosome.description import RobotDescription, get_value, resolve, with_values
from nectosome.description.variables import Variable
from nectosome.measure.signals.noise import correlation_time
from nectosome.units import DIMENSIONS, InputError

from ..fits.errors import range_errors
from ..fits.identifiability import Identifiability, identifiability
from ..fits.misfit import Fit
from .misfit import RobotMisfit
from .trials import Compared, RobotTrial

if TYPE_CHECKING:
    import xarray as xr


_ROUNDS = 3  # of fits, each with the standard errors that the last one left
_EXACT = 1e-6  # of a column's range: the model has made the data, and this stands for a standard error
_COARSE = 1e-3  # gain of chi2 by the last step of a fit that only shows where to go on, in rounds
_SAME = 0.02  # of a range: ends of two starts that are one
_TOGETHER = 5.0  # samples that residuals hang together for: more than noise does by chance
_OFTEN = 3.0  # times the standard error that was given: what is left is more


class RobotFit(NamedTuple):
    """What recordings tell of a robot."""

    variables: tuple[Variable, ...]
    compared: tuple[Compared, ...]
    trials: tuple[RobotTrial, ...]
    theta: Float[np.ndarray, "p"]
    before: Float[np.ndarray, "p"]  # as the robot was described
    errors: Float[np.ndarray, "k"]  # standard error of each column
    computed: tuple[Float[np.ndarray, "k n"], ...]  # of each trial
    told: Identifiability
    starts: int
    agree: int  # starts that came to the same parameters
    warnings: tuple[str, ...]

    def described(self, description: RobotDescription) -> RobotDescription:
        """A robot with what was found."""
        values = zip(self.variables, self.theta, strict=True)
        return with_values(description, {p: float(x) for v, x in values for p in resolve(description, v.name)})


def fit_robot(
    description: RobotDescription,
    variables: Sequence[Variable],
    trials: Sequence[RobotTrial],
    compared: Sequence[Compared],
    errors: Mapping[str, float],
    *,
    starts: int = 1,
    progress: Callable[[str, float], bool | None] = lambda _what, _share: None,
) -> RobotFit:
    """Fit variables within their ranges, from the robot's own values on, and from others that are spread evenly.

    - errors: standard errors of columns, in SI; those of others are taken from what is left.
    - progress(what, share): called between fits and evaluations.

    Raises InputError where the robot cannot be simulated at any start.
    """
    problem = RobotMisfit(trials, variables, compared)
    before = np.array([get_value(description, resolve(description, v.name)[0]) for v in variables], float)
    own = problem.box.places(before)
    begun = [np.where((own >= 0) & (own <= 1), own, 0.5)]
    begun += list(qmc.Halton(len(variables), scramble=False).random(starts)[1:])  # the first is a corner
    sizes = np.array([float(np.nanstd(np.concatenate(rows))) for rows in _columns(trials)])
    given = np.array([errors.get(one.column, np.nan) for one in compared])
    sigma, fits = np.where(np.isnan(given), sizes, given), list[Fit]()
    reasons: InputError | None = None
    for k, place in enumerate(begun):
        progress(f"start {k + 1} of {starts}", 0.6 * k / starts)
        try:
            fits.append(problem.misfit(sigma).fit(problem.box.values(place), gain=_COARSE))
        except InputError as error:
            reasons = error
    if not fits:
        assert reasons is not None
        raise InputError(f"the robot could not be simulated: {reasons.message}", field=reasons.field)
    best = min(fits, key=lambda one: one.chi2)
    ends = problem.box.places(np.array([one.theta for one in fits]))
    agree = int(np.sum(np.abs(ends - problem.box.places(best.theta)).max(axis=1) < _SAME))
    theta = best.theta
    for k in range(_ROUNDS):
        progress("fitting", 0.6 + 0.1 * k)
        sigma = np.where(np.isnan(given), _left(problem, theta, sizes), given)
        theta = problem.misfit(sigma).fit(theta).theta
    progress("intervals", 0.9)
    residuals = problem.residuals(theta)
    left = [[row[np.isfinite(row)] for row in rows] for rows in residuals]
    together = np.array([max(correlation_time(rows[c]) for rows in left) for c in range(len(compared))])
    told = identifiability(problem.misfit(sigma * np.sqrt(together)), theta)
    return RobotFit(
        tuple(variables),
        tuple(compared),
        tuple(trials),
        theta,
        before,
        sigma,
        tuple(problem.computed(theta)),
        told,
        starts,
        agree,
        tuple(_warnings(problem, theta, given, left, together, (starts, agree))),
    )


def _columns(trials: Sequence[RobotTrial]) -> list[list[Float[np.ndarray, "_"]]]:
    """Of each column what was measured in each trial, from its mean."""
    rows = zip(*(trial.measured for trial in trials), strict=True)
    return [[row - np.nanmean(row) for row in column] for column in rows]


def _left(problem: RobotMisfit, theta: Float[np.ndarray, "p"], sizes: Float[np.ndarray, "k"]) -> Float[np.ndarray, "k"]:
    """Root mean square of what is left in each column, for as many degrees of freedom as there are."""
    columns = [np.concatenate(rows) for rows in zip(*problem.residuals(theta), strict=True)]
    count = sum(int(np.isfinite(row).sum()) for row in columns)
    free = count / max(count - len(theta), 1)
    return np.maximum([np.sqrt(free * np.nanmean(row**2)) for row in columns], _EXACT * sizes)


def _warnings(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    given: Float[np.ndarray, "k"],
    left: list[list[Float[np.ndarray, "_"]]],
    together: Float[np.ndarray, "k"],
    starts: tuple[int, int],
) -> list[str]:
    out = []
    for c, one in enumerate(problem.compared):
        rms = float(np.sqrt(np.mean(np.concatenate([rows[c] for rows in left]) ** 2)))
        if together[c] > _TOGETHER:
            hang = f"what is left of {one.column} hangs together for {together[c]:.0f} samples"
            out.append(f"{hang}: the model does not hold all that is there")
        if rms > _OFTEN * given[c]:
            out.append(f"what is left of {one.column} is {rms / given[c]:.1f} times its standard error")
    for name, place in zip(problem.box.names, problem.box.places(theta), strict=True):
        if not 1e-4 < place < 1 - 1e-4:
            out.append(f"{name} is at the end of its range")
    if starts[0] > 1 and starts[1] == 1:
        out.append(f"no other of {starts[0]} starts came to these parameters")
    return out


def robot_data(found: RobotFit, held_out: "Collection[tuple[RobotTrial, np.ndarray]]" = ()) -> "xr.Dataset":
    """Parameters, and the robot beside recordings that were fitted and others, in SI units.

    - over `parameter` (`unit`): `value`, its 95 % interval `low` to `high`, `told`, and `before`, as it was described.
    - over `column` (`reading`, `units_of`): `error`, its standard error.
    - over `recording` (`used`: train or test) and `column`: `e_rmsp`, `e_mp` [percent of its range].
    - over `sample`: `time`, `measured`, `computed`; `of` and `of_column` are places of its recording and its column.

    Attributes: `starts`, `agree`, and `words`, `warnings`, `notes` as JSON.
    """
    import xarray as xr

    rows = [*zip(found.trials, found.computed, strict=True), *held_out]
    of, column, time, measured, computed = [], [], [], [], []
    errors = np.full((len(rows), len(found.compared), 2), np.nan)
    for i, (trial, y) in enumerate(rows):
        for c in range(len(found.compared)):
            there = np.isfinite(trial.measured[c]) & np.isfinite(y[c])
            if there.any():  # a robot that was held out may be one that cannot be simulated
                errors[i, c] = range_errors(y[c][there], trial.measured[c][there])
            of += [i] * trial.time.size
            column += [c] * trial.time.size
            time.append(trial.time)
            measured.append(trial.measured[c])
            computed.append(y[c])
    low, high = np.array([(one.low, one.high) for one in found.told.intervals()]).T
    notes = [f"{trial.file}: {note}" for trial, _ in rows for note in trial.notes]
    return xr.Dataset(
        {
            "value": ("parameter", found.theta),
            "low": ("parameter", low),
            "high": ("parameter", high),
            "before": ("parameter", found.before),
            "told": ("parameter", found.told.told),
            "error": ("column", found.errors),
            "e_rmsp": (("recording", "column"), errors[..., 0], {"units": "percent"}),
            "e_mp": (("recording", "column"), errors[..., 1], {"units": "percent"}),
            "time": ("sample", np.concatenate(time), {"units": "s"}),
            "measured": ("sample", np.concatenate(measured)),
            "computed": ("sample", np.concatenate(computed)),
        },
        coords={
            "parameter": [v.name for v in found.variables],
            "unit": ("parameter", [DIMENSIONS[v.dimension].unit for v in found.variables]),
            "column": [one.column for one in found.compared],
            "reading": ("column", [one.text for one in found.compared]),
            "units_of": ("column", [one.reading.unit for one in found.compared]),
            "recording": [trial.name for trial, _ in rows],
            "used": ("recording", ["train"] * len(found.trials) + ["test"] * (len(rows) - len(found.trials))),
            "of": ("sample", of),
            "of_column": ("sample", column),
        },
        attrs={
            "starts": found.starts,
            "agree": found.agree,
            "words": json.dumps(found.told.words()),
            "warnings": json.dumps(found.warnings),
            "notes": json.dumps(notes),
        },
    )

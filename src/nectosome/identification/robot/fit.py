r"""Unknown quantities of a robot from recordings of it: least squares of its motion, or of its shapes at rest.

$$ \min_\theta \sum_{ck} \left( \frac{y_c(t_k; \theta) - y_{ck}}{\sigma_c} \right)^2 $$

over columns c and samples k. Standard errors that are not given are the root mean squares of the residuals. Residuals
that are correlated over $\tau$ samples count as so many fewer in the intervals. With Huber's loss in place of squares
(`robust_width`) outliers weigh little; intervals are then those of its sandwich.
"""

import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from jaxtyping import Float
from scipy.stats import qmc

from nectosome.description import RobotDescription, check_no_update_rate, check_numbers, resolve
from nectosome.description.variables import Variable, read_variable
from nectosome.designs.design import STARTS
from nectosome.designs.kept_parts import Progress
from nectosome.measure.signals.noise import correlation_time
from nectosome.model import build
from nectosome.model.inputs import RobotLike, description_of
from nectosome.search.executors.spread import spread
from nectosome.units import DIMENSIONS, InputError, check_names, check_whole, shorten

from ..fits.errors import CORRELATED, FAR, at_bounds, held_out_warning, range_errors
from ..fits.identifiability import Identifiability, Interval, identifiability
from ..fits.misfit import HUBER, Fit, robust_width
from ..recordings import CampaignLike, beside_recordings, fitted_and_test, recordings_of
from .fit_progress import FitProgress, KeptFits
from .found_robot import found_robot
from .late_clocks import late_clocks
from .misfit import RTOL, RobotMisfit
from .run_scatter import LEAST, NEEDED, widened_by_scatter
from .standard_errors import StandardErrors, given_error, stated_errors
from .static_rows import lost_row, unstable_rows
from .step_errors import moved_by_steps, shorter, step_errors
from .trial_clocks import Span
from .trials import SLOW, Compared, RobotTrial, read_compared, robot_trials

if TYPE_CHECKING:
    import xarray as xr


_ROUNDS = 3  # of fits at most, each with the standard errors of the residuals of the last one
_SETTLED = 0.01  # standard errors: a round that moves parameters less is the last one
_FITS = 0.2  # of how much a column varies: residuals of a start that fits, where its standard error is not known
_ROUGH = 0.01  # of how much a column varies: error by which parameters count as identifiable where it is not known
_COARSE = 1e-3  # gain of chi2 by the last step of a fit that only shows where to go on, in rounds
_FEW = 4  # recordings, evenly spread, that a start takes at most: what it finds is fitted to all
_LOSSES = {"squares": None, "huber": HUBER}  # bends
_SAME = 0.02  # of a range: results of two starts that are one
_EXAMPLES = {
    "vary": "{'k': '0.05..0.5N m/rad'}",
    "compare": "{'angle': 'fin.angle'}",
    "drive": "{'torque': 'fin.joint.torque'}",
    "errors": "{'angle': '0.5deg'}",
}


class RobotFit(NamedTuple):
    """Unknown quantities of a robot, fitted to recordings."""

    description: RobotDescription  # with its own values
    variables: tuple[Variable, ...]
    compared: tuple[Compared, ...]
    trials: tuple[RobotTrial, ...]
    theta: Float[np.ndarray, "p"]
    before: Float[np.ndarray, "p"]  # as the robot was described
    errors: Float[np.ndarray, "k"]  # standard error of each column
    computed: tuple[Float[np.ndarray, "k n"], ...]  # of each trial
    identifiability: Identifiability
    starts: int
    agree: int  # starts that came to the same parameters
    warnings: tuple[str, ...]
    asked: tuple[str, ...] = ()  # columns whose standard error must be given for intervals: there are none without it
    own: tuple[Variable, ...] = ()  # starts and shifts, which theta has after the variables
    rtol: float = RTOL  # of its time steps
    test: tuple[tuple[RobotTrial, Float[np.ndarray, "k n"]], ...] = ()  # trials that were not fitted, and the model's
    scatter: tuple[str, ...] = ()  # where intervals are wider than by noise, as recordings differ from one another

    @property
    def robot(self) -> RobotDescription:
        """The robot with the values that were found, and with their 95 % intervals where data make these."""
        known = None if self.asked else self.identifiability
        return found_robot(self.description, self.variables, self.theta, known)

    def to_dataset(self) -> "xr.Dataset":
        """Parameters, and the robot beside recordings that were fitted and others, in SI units.

        - over `parameter` (`unit`): `value`, its 95 % interval `low` to `high`, NaN where an error is asked for;
          `low_known` and `high_known`, whether the data make these ends; `identifiable`, and `before`, as the robot was
          described.
        - over `column` (`reading`, `units_of`): `error`, its standard error, NaN where that is asked for.
        - over `recording` (`used`: train or test; `start`, in words) and `column`: `e_rmsp`, `e_mp` [percent of its
          range].
        - over `sample`: `time`, NaN of shapes at rest, `row`, from 1, `measured`, `computed`; `of` and `of_column` are
          places of its recording and column.

        Attributes: `starts`, `agree`, and `words`, `scatter`, `warnings`, `notes`, and `asked`, columns whose standard
        error is asked for, as JSON.
        """
        fitted, held = [*zip(self.trials, self.computed, strict=True)], [*self.test]
        rows, columns = [*fitted, *held], range(len(self.compared))
        errors = np.full((len(rows), len(columns), 2), np.nan)
        for i, (trial, y) in enumerate(rows):
            for c, there in enumerate(np.isfinite(trial.measured) & np.isfinite(y)):
                # a robot may be one that cannot be simulated in a trial that was not fitted
                if there.any() and np.ptp(trial.measured[c][there]) > 0:
                    errors[i, c] = range_errors(y[c][there], trial.measured[c][there])
        units = {v.name: DIMENSIONS[v.dimension].unit for v in (*self.variables, *self.own)}
        samples = {
            "time": ([np.tile(trial.time, len(columns)) for trial, _ in rows], "s"),
            "row": ([np.tile(np.arange(1.0, trial.time.size + 1), len(columns)) for trial, _ in rows], ""),
            "measured": ([trial.measured.ravel() for trial, _ in rows], ""),
            "computed": ([y.ravel() for _, y in rows], ""),
        }
        data = beside_recordings(units, self.trials, [trial for trial, _ in held], samples).assign_coords(
            column=[one.column for one in self.compared],
            start=("recording", [trial.start for trial, _ in rows]),
            reading=("column", [one.text for one in self.compared]),
            units_of=("column", [one.reading.unit for one in self.compared]),
            of_column=("sample", np.concatenate([np.repeat(columns, trial.time.size) for trial, _ in rows])),
        )
        known, nothing = self.identifiability, Interval(np.nan, np.nan, False, False)
        ends = [nothing] * len(units) if self.asked else known.intervals()
        return data.assign(
            value=("parameter", self.theta),
            low=("parameter", [one.low for one in ends]),
            high=("parameter", [one.high for one in ends]),
            low_known=("parameter", [one.below for one in ends]),
            high_known=("parameter", [one.above for one in ends]),
            before=("parameter", self.before),
            identifiable=("parameter", known.identifiable),
            error=("column", self.errors),
            e_rmsp=(("recording", "column"), errors[..., 0], {"units": "percent"}),
            e_mp=(("recording", "column"), errors[..., 1], {"units": "percent"}),
        ).assign_attrs(
            starts=self.starts,
            agree=self.agree,
            words=json.dumps(known.words_without_errors() if self.asked else known.words()),
            scatter=json.dumps(self.scatter),
            asked=json.dumps(self.asked),
            warnings=json.dumps(self.warnings),
            notes=json.dumps([f"{trial.file}: {note}" for trial, _ in rows for note in trial.notes]),
        )


def identify(
    robot: RobotLike,
    campaign: CampaignLike,
    settings: Iterable[str] = (),
    *,
    vary: Mapping[str, str | Sequence[float]],
    compare: Mapping[str, str],
    drive: Mapping[str, str] | None = None,
    errors: Mapping[str, str | float] | None = None,
    skip: float = 0.0,
    start: Mapping[str, Span] | None = None,
    shift: Span | float = 0.0,
    test: Iterable[str] = (),
    loss: str = "squares",
    starts: int | None = None,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> RobotFit:
    """Find unknown quantities of a robot: its simulated motion, or its shape at rest, is fitted to recordings.

        ns.identify("fin.yaml", "campaign.yaml", vary={"k": "0.05..0.5N m/rad"}, compare={"angle": "fin.angle"})

    - robot: a name, a path, a description or a built robot, with `settings` such as "A=30deg".
    - campaign: as `recordings_of` takes it: a campaign file, recordings, or arrays. Conditions of a recording are
      quantities of the robot by their paths or aliases.
    - vary: what is unknown, by path or alias, and its range: text such as "1..9MPa log", or two numbers in SI.
    - compare: columns of the recordings and the readings of the robot that they measure, such as "-force.x".
    - drive: columns that drove the robot, and the paths of the signals that they replace. Where each row is a shape at
      rest, columns that were set, and the paths of numbers or of signals.
    - errors: standard errors of columns, numbers in SI or text with a unit; of others, those that the campaign says, or
      those of the residuals.
    - skip: nothing is compared in the first seconds of each recording [s].
    - start: how the robot starts in each recording that says nothing else, by path or alias of a joint's start or of a
      strain's, as in {"body.joint.position": "-20..20deg"}: a range of what is unknown, which each recording has of its
      own; a number; or "reading", the first reading of the column that measures it. "before.PATH" is what the robot had
      before it was let go: it starts at rest in the static equilibrium with that; {"before": "equilibrium"} is the one
      of the robot as it is. Others start as the robot file says.
    - shift: how much later readings are than the robot and its inputs [s]: a number, or a range such as "-0.2..0.2s" of
      one unknown shift of all recordings that have none of their own.
    - test: file names of recordings that are predicted, not fitted, but for starts and shifts of their own.
    - loss: squares, or huber: readings that are far off, such as outliers of a tracker, weigh little.
    - starts: fits from the robot's own values and from others that are spread evenly over the ranges. Unless given,
      one, and four where that one leaves residuals of more than three standard errors, or of a fifth of what a column
      varies where no error is given, or ends at a bound. They take four recordings at most, evenly spread.
    - folder: the fits from starts are kept there as they come in, and each step of the one in progress: the same call,
      or one with more starts, goes on from there after it was killed.
    - executor: where the fits from all starts are made side by side: any of `concurrent.futures`, or a cluster
      (`nectosome.search.cluster`). Unless given they are made here, one after another.
    - progress(what, share): called after evaluations, with the best so far; where it returns False, FitStoppedError is
      raised, which has that. A fit of more than 10 s says first, with a share of 0, what an evaluation costs, and how
      many are to be expected.

    Rows of a recording without a time (`time: none` in a campaign, None in arrays), or with a single row, are shapes at
    rest: `solve.static` finds each.

    Raises InputError that names the field, or file and column, for what is missing, unknown or does not fit together,
    for fewer readings than unknowns, and where the robot cannot be simulated, or has no shape at rest, at any start;
    for a folder that holds another fit. LostError where the executor ends before.
    """
    if starts is not None:
        check_whole(starts, "starts", 1)
    if loss not in _LOSSES:
        raise InputError(f'"{shorten(loss)}" is no loss. There are {" and ".join(_LOSSES)}.', field="loss")
    for field, given in (("vary", vary), ("compare", compare), ("drive", drive or {}), ("errors", errors or {})):
        check_names(given, field, _EXAMPLES[field])
    description = description_of(robot, settings)
    built = build(description)
    variables = [read_variable(name, span, description) for name, span in vary.items()]
    compared = [read_compared(column, reading, built) for column, reading in compare.items()]
    for field, given in (("vary", variables), ("compare", compared)):
        if not given:
            raise InputError("is empty: at least one is needed.", field=field)
    check_no_update_rate(description, vary)
    paths = [path for v in variables for path in resolve(description, v.name)]
    double = next((path for path in paths if paths.count(path) > 1), None)
    if double is not None:
        raise InputError(f"{double} is named twice.", field="vary")
    sizes = {column: given_error(column, size, compared) for column, size in (errors or {}).items()}
    units = {one.column: one.reading.unit for one in compared}
    recordings = recordings_of(campaign, units)
    sizes = stated_errors(recordings, compared) | sizes
    trials = robot_trials(recordings, description, compared, drive or {}, skip, start, shift)
    double = next((p for one in trials for p in one.set_paths if p in paths), None)
    if double is not None:
        raise InputError(f"{double} is set in a recording, and in vary too: it is known or unknown.", field="vary")
    double = next((p for one in trials for s in one.starts for p in s.paths if p in paths), None)
    if double is not None:
        raise InputError(f"{double} is in vary too: a start is a recording's own, or one of all.", field="start")
    fitted, held = fitted_and_test(trials, test)
    how = {"bend": _LOSSES[loss], "starts": starts, "folder": folder, "executor": executor, "progress": progress}
    found = fit_robot(description, variables, fitted, compared, sizes, **how)
    predicted = [_predicted(trial, found) for trial in held]
    beside = [
        (f"{one.column} of {trial.name}", y, measured, error)
        for trial, rows in zip(held, predicted, strict=True)
        for one, y, measured, error in zip(compared, rows, trial.measured, found.errors.tolist(), strict=True)
        if one.column not in found.asked
    ]
    warnings = (*found.warnings, *held_out_warning(beside), *_impossible(found.robot))
    return found._replace(test=tuple(zip(held, predicted, strict=True)), warnings=warnings)


def _predicted(trial: RobotTrial, found: RobotFit) -> Float[np.ndarray, "k n"]:
    """Readings of the robot that was found, in a trial that was not fitted but for what it has of its own."""
    problem = RobotMisfit([trial], found.variables, found.compared, rtol=found.rtol)
    known = dict(zip((v.name for v in (*found.variables, *found.own)), found.theta, strict=True))
    theta = np.array([known.get(v.name, x) for v, x in zip(problem.variables, problem.begin(), strict=True)])
    if not known.keys() >= {*problem.box.names}:
        theta = problem.misfit(found.errors).fit(theta, fixed=[*known]).theta
    return problem.computed(theta)[0]


def _impossible(robot: RobotDescription) -> list[str]:
    """A sentence where numbers that were found are of no motor or material."""
    try:
        check_numbers(robot)
    except InputError as error:
        return [f"what was found cannot be: {error}"]
    return []


def fit_robot(
    description: RobotDescription,
    variables: Sequence[Variable],
    trials: Sequence[RobotTrial],
    compared: Sequence[Compared],
    errors: Mapping[str, float],
    *,
    bend: float | None = None,
    starts: int | None = 1,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> RobotFit:
    """Fit variables within their ranges to trials; errors [SI], starts, folder, ... as in `identify`.

    With a `bend` by Huber's loss.
    """
    problem = RobotMisfit(trials, variables, compared, bend)
    noise = StandardErrors(trials, compared, errors, problem.box.names, bend is not None)
    before = problem.described()
    counts = (1, STARTS) if starts is None else (starts,)
    few, own = problem.of_few(_FEW)
    begun = [few.box.places(few.begin())]
    begun += list(qmc.Halton(len(own), scramble=False).random(counts[-1])[1:])  # the first is a corner
    sigma, ended, made = noise.first, dict[int, Fit | InputError](), 0
    watch = FitProgress(progress, problem, few)
    problem.each = few.each = None if executor else watch.each
    with KeptFits(folder, problem, sigma, watch.reach) as kept:
        for made in counts:
            ended = {k: one for k, one in kept.ended.items() if k < made}
            watch.begin_starts(made, ended)
            places = {k: few.box.places(theta) for k, theta in kept.reached.items() if k >= 0}
            calls = [(k, _started, (few, sigma, places.get(k, begun[k]))) for k in range(made) if k not in ended]
            if calls and executor is None:
                slow = [f"{one.file}: {note}" for one in trials for note in one.notes if SLOW in note]
                watch.forecast(problem.seconds(problem.begin()), slow)
            going = partial(watch.begin_next, ended)
            here = ((k, f(*args, partial(kept.reach, k))) for k, f, args in calls)
            for k, one in spread(executor, calls, going) if executor else here:
                kept.keep(k, one)
                ended[k] = one
                if executor is None:
                    going()
            if made == 1 and isinstance(one := ended[0], Fit) and _fits(few, one.theta, noise):
                break
        problem.each = watch.each
        fits = [one for k, one in sorted(ended.items()) if isinstance(one, Fit)]
        reasons = [one for _, one in sorted(ended.items()) if isinstance(one, InputError)]
        if not fits:
            lost = lost_row(problem, problem.begin())
            if lost is not None:
                raise lost
            raise InputError(f"the robot could not be simulated: {reasons[-1].message}", field=reasons[-1].field)
        best = min(fits, key=lambda one: one.chi2)
        ends = few.box.places(np.array([one.theta for one in fits]))
        same = np.abs(ends - few.box.places(best.theta)).max(axis=1) < _SAME
        agree, theta = int(same.sum()), problem.begin()
        theta[own] = fits[int(np.argmax(same))].theta  # which of them is best is chance
        watch.begin("fitting", -2)
        theta, sigma = _settled(problem, kept.reached.get(-1, theta), noise, partial(kept.reach, -1))
        shortened = 0
        while shorter(problem, by_steps := step_errors(problem, theta, sigma), shortened):
            theta, sigma = _settled(problem, theta, noise, partial(kept.reach, -1))
            shortened += 1
    watch.begin("clocks", -1)
    residuals = [[row[np.isfinite(row)] for row in rows] for rows in problem.residuals(theta)]
    moving = [rows for rows, trial in zip(residuals, trials, strict=True) if trial.rows is None]
    share = theta.size / max(sum(row.size for rows in residuals for row in rows), 1)  # parameters for each residual
    most = np.full(len(compared), np.inf) if bend is None else bend * sigma  # outliers hide a correlation
    times = [
        [
            correlation_time(np.clip(row, -x, x), share * row.size) if row.size else 1.0
            for row, x in zip(rows, most, strict=True)
        ]
        for rows in moving
    ]
    correlated = np.array([max([1.0, *(rows[c] for rows in times)]) for c in range(len(compared))])
    robust = np.ones(len(compared))
    if bend is not None:
        columns = (np.concatenate([rows[c] for rows in residuals]) / sigma[c] for c in range(len(compared)))
        robust = np.array([robust_width(rows, bend) for rows in columns])
    widths = _ROUGH * noise.first if noise.asked else sigma * np.sqrt(correlated) * noise.wider * robust
    known = identifiability(problem.misfit(widths), theta)
    scatter = list[str]()
    if not noise.asked:
        known, scatter = widened_by_scatter(problem, theta, sigma, known)
    warnings = [*_warnings(problem, theta, noise.given, residuals, correlated, (made, agree))]
    warnings += [*noise.question(), *unstable_rows(problem, theta), *moved_by_steps(problem, theta, by_steps, known)]
    warnings += late_clocks(problem, theta, sigma, variables)
    return RobotFit(
        description,
        tuple(variables),
        tuple(compared),
        tuple(trials),
        theta,
        before,
        np.where([one.column in noise.asked for one in compared], np.nan, sigma),
        tuple(problem.computed(theta)),
        known,
        made,
        agree,
        tuple(warnings),
        noise.asked,
        problem.variables[len(variables) :],
        problem.rtol,
        scatter=tuple(scatter),
    )


def _fits(problem: RobotMisfit, theta: Float[np.ndarray, "p"], noise: StandardErrors) -> bool:
    """Whether parameters from a start are within their ranges, and leave what noise may leave of each column."""
    each = [np.concatenate(rows) for rows in zip(*problem.residuals(theta), strict=True)]
    left = np.array([np.sqrt(np.nanmean(rows**2)) for rows in each])
    most = np.where(np.isnan(noise.given), _FITS * noise.sizes, FAR * noise.given)
    return bool(np.all(left <= most)) and not at_bounds(problem.box, problem.box.places(theta))


def _settled(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    noise: StandardErrors,
    reached: Callable[[Float[np.ndarray, "p"], float], object],
) -> tuple[Float[np.ndarray, "p"], Float[np.ndarray, "k"]]:
    """Parameters, and standard errors of the columns that are those of the residuals.

    While they follow from residuals, a fit that others follow is rough: the last one began with exact derivatives.
    """
    sigma = noise.first
    for left in reversed(range(_ROUNDS)):
        sigma, before = noise.of(problem.residuals(theta)), problem.box.places(theta)
        misfit = problem.misfit(sigma)
        by = misfit.derivatives(before)  # which the fit begins with
        gain = _COARSE if left and noise.follow and misfit.precision > 0 else 0.0
        theta = misfit.fit(theta, gain=gain, reached=reached).theta
        moved = by @ (problem.box.places(theta) - before)
        if moved @ moved < _SETTLED**2:
            break
    return theta, sigma


def _started(
    problem: RobotMisfit,
    errors: Float[np.ndarray, "k"],
    place: Float[np.ndarray, "p"],
    reached: Callable[[Float[np.ndarray, "p"], float], object] | None = None,
) -> Fit | InputError:
    """A rough fit from a place in the ranges, or why there is none."""
    try:
        return problem.misfit(errors).fit(problem.box.values(place), gain=_COARSE, reached=reached)
    except InputError as error:
        return error


def _warnings(
    problem: RobotMisfit,
    theta: Float[np.ndarray, "p"],
    given: Float[np.ndarray, "k"],
    residuals: list[list[Float[np.ndarray, "_"]]],
    correlated: Float[np.ndarray, "k"],
    starts: tuple[int, int],
) -> list[str]:
    out = []
    for c, one in enumerate(problem.compared):
        rms = float(np.sqrt(np.mean(np.concatenate([rows[c] for rows in residuals]) ** 2)))
        if correlated[c] > CORRELATED:
            samples = f"{correlated[c]:.0f} samples"
            more = "" if len(problem.trials) >= LEAST else f". {NEEDED}"
            out.append(f"residuals of {one.column} are correlated over {samples}: the model lacks something{more}")
        if rms > FAR * given[c]:
            out.append(f"residuals of {one.column} are {rms / given[c]:.1f} times its standard error")
    units = [DIMENSIONS[v.dimension].unit for v in problem.variables]
    out += at_bounds(problem.box, problem.box.places(theta), units)
    if starts[0] > 1 and starts[1] == 1:
        out.append(f"no other of {starts[0]} starts came to these parameters")
    return out

"""Files of gaits that a robot is fitted to: the robot, its unknown quantities, and features of each trial."""

from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Annotated

from pydantic import Field

from nectosome.description import load_robot
from nectosome.description.fields import Length, PositiveFrequency, PositiveNumber, PositiveSpeed, PositiveTime
from nectosome.description.robot_file import read_value
from nectosome.description.variables import RangesText, Variable, read_variable
from nectosome.designs.design import SEED
from nectosome.designs.kept_parts import Progress
from nectosome.io.schema.described import Described, Text
from nectosome.io.schema.validate import errors_at, validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.robots import describe
from nectosome.search import OPTIMISERS, minimise
from nectosome.units import InputError, did_you_mean

from ..fits.identifiability import identifiability
from .fit import GaitFit, GaitResult, GaitTrial, gait_optimiser


class TrialDescription(Described):
    """A gait that was measured."""

    amplitude: Length
    """Amplitude of the height of the body, from its lowest to its highest value."""
    frequency: PositiveFrequency
    """Frequency of the height."""
    speed: PositiveSpeed
    """Mean speed along x."""
    height: Length
    """Mean height of the body."""
    set: dict[str, Text] = Field(default_factory=dict)
    """What differs from the robot in this trial, by path or alias: `{volume: 0.64 L}`."""


class GaitsDescription(Described):
    """Features of measured gaits, and the quantities of a robot on legs that are found from them."""

    about: str = ""
    """What was measured, in sentences."""
    robot: str
    """A robot that ships, by name, or a robot file beside this one."""
    vary: RangesText
    """Unknown quantities of the robot, by path or alias, each with a range."""
    seconds: PositiveTime = 25.0
    """Length of a walk, a whole number of windows; features are taken of the last one."""
    window: PositiveTime = 5.0
    """Length of a window."""
    error: PositiveNumber = 0.01
    """Relative standard error of the features, for the identifiability of the parameters."""
    trials: Annotated[tuple[TrialDescription, ...], Field(min_length=1)]
    """The gaits, each with amplitude, frequency, speed and height."""


def identify_gait(
    target: str | Path | GaitFit,
    *,
    optimiser: str = "cmaes",
    seed: int = SEED,
    evaluations: int = 3000,
    goal: float = 1e-6,
    folder: str | Path | None = None,
    executor: Executor | None = None,
    progress: Progress | None = None,
) -> GaitResult:
    """Find parameters with which a robot on legs has the features of measured gaits, and which are identifiable.

    - target: a file of gaits (`load_gait_fit`), or what it holds.
    - optimiser: cmaes, genetic, differential, or nsga2, for which each trial is an objective of its own.
    - evaluations: no iteration is begun after so many walks of each trial; goal: a discrepancy at which it ends.
    - folder: walks are kept there: the same call goes on from them after an interruption.
    - executor: where the walks of a generation are computed: any of `concurrent.futures`, or a cluster
      (`nectosome.search.cluster`); eight go together, of large generations 25. Unless given, in threads here.
    - progress(what, share): called after each generation; the search ends where it returns False.

    Raises InputError for a file that makes no sense, an unknown optimiser, and where no candidate walks; LostError
    where the executor ends before.
    """
    everywhere = [name for name, kind in OPTIMISERS.items() if not kind.needs_start]
    if optimiser not in everywhere:
        raise InputError(f'"{optimiser}" is none for gaits.{did_you_mean(optimiser, everywhere)}', field="optimiser")
    fit = target if isinstance(target, GaitFit) else load_gait_fit(target)
    fit = replace(fit, executor=executor) if executor else fit
    several = optimiser == "nsga2"
    if several and len(fit.trials) < 2:
        raise InputError("nsga2 is between several trials, and there is one. Take another one.", field="optimiser")

    def report(done: int, best: float) -> bool | None:
        return None if progress is None else progress(f"discrepancy {best:.2g}", done / evaluations)

    found = minimise(
        fit.task(by_trial=several),
        gait_optimiser(optimiser, evaluations),
        seed=seed,
        target=None if several else goal,
        folder=folder,
        progress=report,
    ).summed()  # of a front, the one with the least sum is the best
    if found.best is None:
        raise InputError("no candidate walks: none of them gave features.", field="target")
    best = fit.ranges.values(found.best.u)
    known = identifiability(fit.misfit, best)
    return GaitResult(fit, found, fit.walked(best[None]), known, max(10 * found.value, goal))


def load_gait_fit(path: str | Path) -> GaitFit:
    """Read a file of gaits (`GaitsDescription`). Raises InputError that names file, line and field."""
    source = str(path)
    data, lines = read_yaml(read_text(path), source)
    given = validate_as(GaitsDescription, data, "gaits", file=source, lines=lines)
    at = partial(errors_at, source, lines)
    with at("robot"):
        beside = Path(path).parent / given.robot
        robot = load_robot(beside) if beside.suffix in (".yaml", ".yml") else describe(given.robot)
    variables = list[Variable]()
    for name, span in given.vary.items():
        with at("vary", name):
            variables.append(read_variable(name, span, robot))
    trials = list[GaitTrial]()
    for k, one in enumerate(given.trials):
        changes = dict[str, float]()
        for name, text in one.set.items():
            with at("trials", k, "set", name):
                (changes[name],) = {*read_value(name, text, robot).values()}
        trials.append(GaitTrial((one.amplitude, one.frequency, one.speed, one.height), changes))
    try:
        return GaitFit(robot, tuple(variables), tuple(trials), given.seconds, given.window, given.error)
    except InputError as error:
        line = lines.get((error.field or "",)) or lines.get(("vary", error.field or ""))
        raise InputError(error.message, file=source, line=line, field=error.field) from None

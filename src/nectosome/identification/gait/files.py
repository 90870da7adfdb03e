"""Files of gaits that a robot is fitted to: the robot, its unknown quantities, and features of each trial."""

from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from nectosome.description import RobotDescription, load_robot, numeric_paths, resolve
from nectosome.description.variables import Variable, read_variable
from nectosome.designs.design import SEED
from nectosome.designs.problem import YamlFields
from nectosome.designs.sweep import Progress
from nectosome.io.yaml_text import Key, read_text
from nectosome.robots import describe
from nectosome.search import OPTIMISERS, Start, minimise
from nectosome.units import InputError, did_you_mean, parse_quantity, shorten

from ..fits.identifiability import Identifiability, identifiability
from .fit import GaitFit, GaitTrial, gait_data, gait_optimiser
from .walks import FEATURES, UNITS, Walked

if TYPE_CHECKING:
    import xarray as xr

_KNOWN = ("about", "robot", "vary", "seconds", "window", "error", "trials")
_DIMENSIONS = {"m": "length", "Hz": "frequency", "m/s": "speed"}


class GaitResult(NamedTuple):
    """A walking robot, fitted to features of its gaits."""

    fit: GaitFit
    search: Start  # all candidates; of several objectives their sum
    walked: list[Walked]  # the best candidate's walk in each trial
    identifiability: Identifiability  # by the features
    as_good: float  # candidates of at most this discrepancy are as good

    def to_dataset(self) -> "xr.Dataset":
        """Parameters, features, motion and history (`gait_data`)."""
        return gait_data(self.fit, self.search, self.walked, self.identifiability, self.as_good)


def identify_gait(
    target: str | Path | GaitFit,
    *,
    optimiser: str = "cmaes",
    seed: int = SEED,
    evaluations: int = 3000,
    goal: float = 1e-6,
    folder: str | Path | None = None,
    progress: Progress | None = None,
) -> GaitResult:
    """Find parameters with which a robot on legs has the features of measured gaits, and which are identifiable.

    - target: a file of gaits (`load_gait_fit`), or what it holds.
    - optimiser: cmaes, genetic, differential, or nsga2, for which each trial is an objective of its own.
    - evaluations: no iteration is begun after so many walks of each trial; goal: a discrepancy at which it ends.
    - folder: walks are kept there: the same call goes on from them after an interruption.
    - progress(what, share): called after each generation; the search ends where it returns False.

    Raises InputError for a file that makes no sense, an unknown optimiser, and where no candidate walks.
    """
    everywhere = [name for name, kind in OPTIMISERS.items() if not kind.needs_start]
    if optimiser not in everywhere:
        raise InputError(f'"{optimiser}" is none for gaits.{did_you_mean(optimiser, everywhere)}', field="optimiser")
    fit = target if isinstance(target, GaitFit) else load_gait_fit(target)
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
    """Read a file of gaits. Raises InputError that names file, line and field.

    `robot` is the name of one that ships or a robot file beside this one; `vary` gives each unknown quantity a range;
    `trials` are a list of features, amplitude, frequency, speed and height, with what differs from the robot in `set`;
    `error` is their relative standard error.
    """
    file = YamlFields(read_text(path), str(path), "file of gaits", _KNOWN)
    data = file.data
    ranges, trials = data.get("vary"), data.get("trials")
    if not isinstance(ranges, dict) or not ranges:
        raise file.wrong(("vary",), "needs at least one name with a range.")
    if not isinstance(trials, list) or not trials:
        raise file.wrong(("trials",), "needs at least one gait, with a dash before it.")
    description = _robot(file, data.get("robot"))
    variables = list[Variable]()
    for name, span in ranges.items():
        with file.errors_at("vary", name):
            variables.append(read_variable(name, str(span), description))
    found = tuple(_trial(file, k, one, description) for k, one in enumerate(trials))
    kinds = {"seconds": "time", "window": "time", "error": "number"}
    numbers = {key: _positive(file, (key,), data[key], kind) for key, kind in kinds.items() if key in data}
    try:
        return GaitFit(description, tuple(variables), found, **numbers)
    except InputError as error:
        line = file.lines.get((error.field or "",)) or file.lines.get(("vary", error.field or ""))
        raise InputError(error.message, file=str(path), line=line, field=error.field) from None


def _positive(file: YamlFields, at: Key, text: Any, dimension: str) -> float:
    """A positive quantity with its unit."""
    with file.errors_at(*at):
        value = parse_quantity(str(text), dimension)
    if not value > 0:
        raise file.wrong(at, f'"{shorten(text)}" is out of range: it must be more than 0.')
    return value


def _robot(file: YamlFields, name: Any) -> RobotDescription:
    if not isinstance(name, str):
        raise file.wrong(("robot",), "is missing. Name a robot that ships, or a robot file.")
    beside = Path(file.source).parent / name
    try:
        return load_robot(beside) if beside.suffix in (".yaml", ".yml") else describe(name)
    except InputError as error:
        raise file.wrong(("robot",), str(error)) from None


def _trial(file: YamlFields, k: int, one: Any, description: RobotDescription) -> GaitTrial:
    at: Key = ("trials", k)
    if not isinstance(one, dict):
        raise file.wrong(at, "has no named fields: amplitude, frequency, speed and height are needed.")
    for key in one:
        if key not in (*FEATURES, "set"):
            raise file.wrong((*at, str(key)), f"is not known here.{did_you_mean(str(key), (*FEATURES, 'set'))}")
    for name in FEATURES:
        if one.get(name) is None:
            raise file.wrong((*at, name), "is missing.")
    a, f, v, z = (_positive(file, (*at, f), one[f], _DIMENSIONS[u]) for f, u in zip(FEATURES, UNITS, strict=True))
    changes, quantities = one.get("set", {}), numeric_paths(description)
    if not isinstance(changes, dict):
        raise file.wrong((*at, "set"), "needs names with values.")
    values = dict[str, float]()
    for name, text in changes.items():
        with file.errors_at(*at, "set", str(name)):
            read = [quantities[path].read(str(text), units_required=True) for path in resolve(description, str(name))]
            (values[str(name)],) = {*read}
    return GaitTrial((a, f, v, z), values)

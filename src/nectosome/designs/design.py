"""Design: the numbers of a robot with which its motion is best, or with which its mission takes least time."""

import pickle
import re
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from contextlib import nullcontext
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.description import RobotDescription, dump_robot
from nectosome.description.mission import Mission
from nectosome.io.atomic import write_atomic
from nectosome.io.file_system import is_file
from nectosome.io.yaml_text import read_text
from nectosome.model.inputs import RobotLike, description_of
from nectosome.robots import mission_of
from nectosome.search import Evaluation, Optimiser, Result, make_optimiser, multistart
from nectosome.search.search_folder import read_share
from nectosome.units import InputError, check_whole

from .axes import each_structure, structures_of
from .constraints import Constraint, read_percent
from .design_task import DesignTask
from .kept_parts import Progress
from .motion import MotionDesign
from .problem import Problem, RangeLike, load_problem, problem_of
from .quantities import Objective
from .schedule import ScheduleDesign

if TYPE_CHECKING:
    import xarray as xr

STARTS, SEED = 4, 1
BEST = "best.yaml"
"""File of the best design so far in the folder of a search."""


@dataclass(frozen=True, eq=False)
class DesignResult:
    """What a search for a design found."""

    task: DesignTask
    search: Result  # all starts with their evaluations
    choice: str = ""  # values of the choices and counts
    choices: tuple["DesignResult", ...] = ()  # of all of them, where there are some
    added: tuple[str, ...] = ()  # limits that no problem names: servos follow their motion
    outside: tuple[str, ...] = ()  # variables whose own values are out of their ranges, where a start began there

    @property
    def best(self) -> Evaluation | None:
        """The best design that keeps all limits; None where none was found."""
        return next((start.best for start in self.search.best()), None)

    @property
    def cancelled(self) -> bool:
        """Whether it was cancelled: the best design is the best so far."""
        return self.search.cancelled or any(one.search.cancelled for one in self.choices)

    @property
    def robot(self) -> RobotDescription | None:
        """The robot of the best design; None where none was found."""
        if self.best is None:
            return None
        return self.task.robot_at(self.best.u) if isinstance(self.task, MotionDesign) else self.task.description

    @property
    def mission(self) -> Mission | None:
        """The mission of the best design; None where none was found, or where the design is of a motion."""
        if self.best is None or not isinstance(self.task, ScheduleDesign):
            return None
        return self.task.mission_at(self.best.u)

    @property
    def text(self) -> str:
        """The robot or mission file of the best design; empty where none was found."""
        return "" if self.best is None else self.task.chosen(self.best.u)

    def to_dataset(self) -> "xr.Dataset":
        """All evaluations, start after start, as `Result.to_dataset` has them."""
        return self.search.to_dataset()


def design(
    robot: RobotLike,
    settings: Iterable[str] = (),
    *,
    problem: Problem | str | Path | None = None,
    vary: Mapping[str, RangeLike] | None = None,
    maximise: Objective = "",
    minimise: Objective = "",
    keep: Iterable[str | Constraint] = (),
    quantile: float | str = 0.0,
    draws: int = 0,
    forward: str = "",
    mission: str | Path = "",
    whole: bool = False,
    optimiser: str | Optimiser | None = None,
    starts: int = STARTS,
    seed: int = SEED,
    own_first: bool = False,
    folder: str | Path | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    share: str = "1/1",
    progress: Progress | None = None,
) -> DesignResult:
    """Find the numbers of a robot with which a quantity of its motion is largest or smallest, or its mission shortest.

        ns.design("flagellum", keep=["torque <= 0.4 N m"])
        ns.design("robot.yaml", vary={"limbs.fin.length": "50..90mm"}, maximise="efficiency", forward="-x")
        ns.design("robot.yaml", maximise="forward_speed / power")  # or a function of them: lambda q: q["speed"] ** 2

    - robot: a name, a path, a description or a built robot; `settings` such as "omega=14rad/s" fix quantities of it.
    - vary: ranges by path or alias, in steps where they have one, as "2..6mm:0.5mm". A categorical variable takes a
      list, {"body.joint.servo.model": "XC330-M288-T,XW540-T140-R"}, a count of a family or a file as well, {"N":
      "1..3"} or {"limbs.fin.repeat.count": "2,4"}; each has a search of its own: the result is that of the best one.
    - problem: in words, or the path of a problem file; unless given that of the robot (`problem_of`). `vary`,
      `maximise` or `minimise`, `keep`, `quantile`, `draws`, `forward` and `mission`, a file or the name of one that
      ships, change it (`Problem`). Servos follow their motion, `voltage_demand <= 1`, unless another limit on it is
      given.
    - quantile, draws: "10 %" of what is maximised, over 16 draws of what is not known exactly unless `draws` says how
      many. They are the same for all designs. A limit "torque <= 0.5 N m @ 90 %" is kept in that share of them.
    - whole: every limb is solved, as by `periodic`, also where equal ones do the same.
    - optimiser: a name such as gradient, pattern, cmaes or genetic, or one with options; gradient unless given, cmaes
      for a mission.
    - starts, seed: how many searches from designs drawn at random, and the seed of these and of `draws`; with
      `own_first` the first search begins with the robot's own numbers.
    - folder: evaluations are kept there: the same call goes on from them after an interruption. The best design so far
      is in `best.yaml` there.
    - workers: processes; one a processor unless given.
    - executor: where evaluations are made instead: any of `concurrent.futures`, or a cluster
      (`nectosome.search.cluster`).
    - share: "2/8" makes the second of eight shares of the starts, into a folder of its own;
      `nectosome.search.gather_starts` joins them.
    - progress(what, share): called twice a second; the search is cancelled where it returns False, and the best design
      of the result is the best so far.

    Raises InputError for words that do not fit the robot or each other, and for a folder of another search;
    LostError where the executor ends before.
    """
    part = read_share(share, "share")
    check_whole(starts, "starts", 1)
    check_whole(seed, "seed", 0)
    if workers is not None:
        check_whole(workers, "workers", 1)
    settings = [settings] if isinstance(settings, str) else [*settings]
    description = description_of(robot, settings)
    if not isinstance(problem, Problem):
        named = robot if isinstance(robot, str | Path) else description.name
        problem = problem_of(named) if problem is None else load_problem(problem)
    text = read_text(mission_of(str(mission)) or mission) if str(mission) else ""
    words = {"maximise": maximise, "minimise": minimise, "forward": forward, "mission": text}
    robust = {"quantile": read_percent(quantile, "quantile") if quantile else 0.0, "draws": draws}
    fixed = [setting.partition("=")[0].strip() for setting in settings]
    problem = problem.changed(description, fixed=fixed, vary=vary, keep=keep, whole=whole, **words, **robust)
    if not problem.vary:
        raise InputError("nothing varies. Give vary PATH=LOW..HIGH, or a problem file with ranges.", field="vary")
    if optimiser is None:
        optimiser = "cmaes" if problem.mission else "gradient"
    if isinstance(optimiser, str):
        optimiser = make_optimiser(optimiser)
    for goal in ("maximise", "minimise"):
        _check_sendable(getattr(problem, goal), goal, executor)
    structures = {} if problem.mission else structures_of(robot, problem.vary, settings)
    problem = replace(problem, vary={name: span for name, span in problem.vary.items() if name not in structures})
    if not problem.vary:
        words = "only choices vary. Give a number with its range too, or compare them by nectosome sweep --over."
        raise InputError(words, field="vary")
    tasks = dict[str, DesignTask]()
    for values, one in each_structure(robot, structures, settings).items():
        task = tasks[", ".join(map(str, values))] = problem.task(one, seed)
        optimiser.check_task(task, True)
    for task in tasks.values():
        task.prepare()  # mistakes come before anything is begun
    searches = list[DesignResult]()
    for k, (name, task) in enumerate(tasks.items()):

        def tell(words: str, gone: float, done: int = k, name: str = name) -> bool | None:
            message = f"{name}: {words}" if name else words
            return None if progress is None else progress(message, (done + gone) / len(tasks))

        own = re.sub(r"[^\w.-]+", "_", f"choice_{name}")
        place = Path(folder) / own if folder is not None and name else folder
        options = {"folder": place, "workers": workers, "executor": executor, "share": part}
        kept = _BestFile(task, [one.best for one in searches], place, folder)
        found = _search(task, problem, optimiser, (starts, seed), kept, own_first=own_first, progress=tell, **options)
        searches.append(replace(found, choice=name))
        if searches[-1].search.cancelled:
            break
    best = min(searches, key=lambda one: np.inf if one.best is None else one.best.objective)
    return replace(best, choices=tuple(searches) if best.choice else ())


def _check_sendable(objective: Objective, field: str, executor: Executor | None) -> None:
    """Raise InputError for a function that other processes cannot import."""
    if isinstance(objective, str) or not (executor is None or isinstance(executor, ProcessPoolExecutor)):
        return
    typed_in = getattr(objective, "__module__", "") == "__main__" and not is_file(
        getattr(sys.modules["__main__"], "__file__", "")
    )
    try:
        pickle.dumps(objective)
    except (pickle.PicklingError, AttributeError, TypeError):
        typed_in = True
    if typed_in:
        words = "worker processes cannot import this function. Define it at the top level of a file that is imported,"
        raise InputError(f"{words} or give executor=concurrent.futures.ThreadPoolExecutor().", field=field)


class _BestFile:
    """The best design so far, in `best.yaml` of the folder of its choice, and of the whole search."""

    def __init__(self, task: DesignTask, before: list[Evaluation | None], *folders: str | Path | None):
        others = min((one.objective for one in before if one is not None), default=np.inf)
        self._task, self._lowest = task, dict.fromkeys((Path(f) for f in folders if f is not None), np.inf)
        if self._lowest:
            self._lowest[[*self._lowest][-1]] = others

    def keep(self, best: Evaluation | None) -> None:
        """Write it where it is better. Raises InputError where the file cannot be written."""
        for folder, lowest in self._lowest.items():
            if best is not None and best.objective < lowest:
                write_atomic(folder / BEST, self._task.chosen(best.u).encode())
                self._lowest[folder] = best.objective


def _search(
    task: DesignTask,
    problem: Problem,
    optimiser: Optimiser,
    counts: tuple[int, int],
    kept: _BestFile,
    *,
    own_first: bool,
    folder: str | Path | None,
    progress: Progress,
    **options: Any,
) -> DesignResult:
    """Search with one value of each choice and count; `counts` are those of starts, and the seed."""

    def pulse(done: int, best: Evaluation | None, evaluations: int, share: float) -> bool | None:
        kept.keep(best)
        words = "" if best is None else f"best {task.objective_name} {task.shown(best)}, "
        return progress(f"{words}{evaluations} evaluations", share)

    own = task.own if own_first else None
    words = {"keep": [*map(str, problem.keep)]}
    words |= {goal: getattr(problem, goal) and task.objective_name for goal in ("maximise", "minimise")}
    about = {"robot": dump_robot(task.description), "problem": asdict(problem) | words}
    # without a folder evaluations would be lost with a worker that is ended
    with TemporaryDirectory() if folder is None else nullcontext(folder) as place:
        first = None if own is None else np.clip(own, 0.0, 1.0)
        options |= {"first": first, "folder": place, "about": about, "progress": pulse}
        found = multistart(task, optimiser, *counts, **options)
    result = DesignResult(task, found, added=tuple(name for name in task.constraint_names if name not in words["keep"]))
    kept.keep(result.best)
    outside = () if own is None else (n for n, x in zip(task.names, own, strict=True) if not -1e-9 <= x <= 1 + 1e-9)
    return replace(result, outside=tuple(outside))

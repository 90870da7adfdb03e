"""Design: the numbers of a robot with which its motion is best, or with which its mission takes least time."""

import pickle
import re
import sys
from collections.abc import Iterable, Mapping
from concurrent.futures import Executor, ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from nectosome.description import RobotDescription, dump_robot
from nectosome.description.mission import Mission
from nectosome.io.file_system import is_file
from nectosome.io.yaml_text import read_text
from nectosome.model.inputs import RobotLike, description_of
from nectosome.robots import mission_of
from nectosome.search import Evaluation, Optimiser, Result, make_optimiser, multistart
from nectosome.search.executors.shares import read_share
from nectosome.units import InputError, check_whole

from .axes import with_each_choice
from .constraints import Constraint
from .motion import DesignTask, MotionDesign
from .problem import Problem, RangeLike, load_problem, problem_of
from .quantities import Objective
from .schedule import ScheduleDesign
from .sweep import Progress

if TYPE_CHECKING:
    import xarray as xr

STARTS, SEED = 4, 1


@dataclass(frozen=True, eq=False)
class DesignResult:
    """What a search for a design found."""

    task: DesignTask
    search: Result  # all starts with their evaluations
    choice: str = ""  # values of the categorical variables
    choices: tuple["DesignResult", ...] = ()  # of all choices, where there are some

    @property
    def best(self) -> Evaluation | None:
        """The best design that keeps all limits; None where none was found."""
        return next((start.best for start in self.search.best()), None)

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
    forward: str = "",
    mission: str | Path = "",
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
    - vary: ranges by path or alias; a categorical variable takes a list, {"body.joint.servo.model":
      "XC330-M288-T,XW540-T140-R"}, and each choice a search of its own: the result is that of the best one.
    - problem: in words, or the path of a problem file; unless given that of the robot (`problem_of`). `vary`,
      `maximise` or `minimise`, `keep`, `forward` and `mission`, a file or the name of one that ships, change it
      (`Problem`).
    - optimiser: a name such as gradient, pattern, cmaes or genetic, or one with options; gradient unless given, cmaes
      for a mission.
    - starts, seed: how many searches from designs drawn at random, and the seed of the draws; with `own_first` the
      first search begins with the robot's own numbers.
    - folder: evaluations are kept there: the same call goes on from them after an interruption.
    - workers: processes; one a processor unless given.
    - executor: where evaluations are made instead: any of `concurrent.futures`, or a cluster
      (`nectosome.search.cluster`).
    - share: "2/8" makes the second of eight shares of the starts, into a folder of its own;
      `nectosome.search.gather_starts` joins them.
    - progress(what, share): called twice a second; the search is cancelled where it returns False.

    Raises InputError for words that do not fit the robot or each other, and for a folder of another search;
    LostError where the executor ends before.
    """
    part = read_share(share, "share")
    check_whole(starts, "starts", 1)
    check_whole(seed, "seed", 0)
    settings = [settings] if isinstance(settings, str) else [*settings]
    description = description_of(robot, settings)
    if not isinstance(problem, Problem):
        named = robot if isinstance(robot, str | Path) else description.name
        problem = problem_of(named) if problem is None else load_problem(problem)
    text = read_text(mission_of(str(mission)) or mission) if str(mission) else ""
    words = {"maximise": maximise, "minimise": minimise, "forward": forward, "mission": text}
    fixed = [setting.partition("=")[0].strip() for setting in settings]
    problem = problem.changed(description, fixed=fixed, vary=vary, keep=keep, **words)
    if not problem.vary:
        raise InputError("nothing varies. Give vary PATH=LOW..HIGH, or a problem file with ranges.", field="vary")
    if optimiser is None:
        optimiser = "cmaes" if problem.mission else "gradient"
    if isinstance(optimiser, str):
        optimiser = make_optimiser(optimiser)
    if optimiser.derivatives and problem.mission:
        raise InputError("a mission has no derivatives. Take cmaes or pattern.", field="optimiser")
    for goal in ("maximise", "minimise"):
        _check_sendable(getattr(problem, goal), goal, executor)
    robots, ranges = with_each_choice(description, problem.vary)
    if not ranges:
        words = "only choices vary. Give a number with its range too, or compare them by nectosome sweep --over."
        raise InputError(words, field="vary")
    problem = replace(problem, vary=ranges)
    found = list[DesignResult]()
    for k, (name, one) in enumerate(robots.items()):

        def tell(words: str, gone: float, done: int = k, name: str = name) -> bool | None:
            message = f"{name}: {words}" if name else words
            return None if progress is None else progress(message, (done + gone) / len(robots))

        own = re.sub(r"[^\w.-]+", "_", f"choice_{name}")
        place = Path(folder) / own if folder is not None and name else folder
        where = {"workers": workers, "executor": executor, "share": part}
        options = {"own_first": own_first, "folder": place, "where": where, "progress": tell}
        found.append(replace(_search(one, problem, optimiser, (starts, seed), **options), choice=name))
        if found[-1].search.cancelled:
            break
    best = min(found, key=lambda one: np.inf if one.best is None else one.best.objective)
    return replace(best, choices=tuple(found) if best.choice else ())


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


def _search(
    description: RobotDescription,
    problem: Problem,
    optimiser: Optimiser,
    counts: tuple[int, int],
    *,
    own_first: bool,
    folder: str | Path | None,
    where: Mapping[str, Any],
    progress: Progress,
) -> DesignResult:
    """Search with one value of each categorical variable; `counts` are those of starts, and the seed."""
    starts, seed = counts
    made = len(range(where["share"][0] - 1, starts, where["share"][1]))
    task = problem.task(description)
    task.prepare()  # mistakes come before anything is begun

    def pulse(done: int, best: Evaluation | None, evaluations: int) -> bool | None:
        found = "" if best is None else f"best {task.objective_name} {task.shown(best)}, "
        share = max(done, evaluations / optimiser.evaluations) / max(made, 1)  # a start may need fewer than it may make
        return progress(f"{found}{evaluations} evaluations", min(share, 1.0))

    first = task.own if own_first else None
    words = {"keep": [*map(str, problem.keep)]}
    words |= {goal: getattr(problem, goal) and task.objective_name for goal in ("maximise", "minimise")}
    about = {"robot": dump_robot(description), "problem": asdict(problem) | words}
    options = {"first": first, "folder": folder, "about": about, **where}
    found = multistart(task, optimiser, starts, seed, progress=pulse, **options)
    return DesignResult(task, found)

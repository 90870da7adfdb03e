"""Design problems in words: what may vary, what is made as large or small as possible, which limits hold."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, WithJsonSchema

from nectosome.description import RobotDescription
from nectosome.description.fields import Direction
from nectosome.description.mission import parse_mission, read_schedule_variable
from nectosome.description.variables import RangesText, read_variable
from nectosome.io.file_system import entries, is_file
from nectosome.io.schema.described import Described, Text, unfit
from nectosome.io.schema.validate import errors_at, validate_as
from nectosome.io.yaml_text import read_text, read_yaml
from nectosome.robots import mission_of
from nectosome.units import InputError, shorten

from .axes import check_each_once, paths_of, set_paths
from .constraints import SERVOS_FOLLOW, Constraint, read_constraint, read_percent
from .design_task import DesignTask
from .motion import MotionDesign
from .quantities import QUANTITIES, Objective, formula_of
from .robust import DRAWS, RobustDesign
from .schedule import ScheduleDesign
from .uncertain_runs import LEAST_DRAWS, MOST_DRAWS


def _goal(text: str) -> str:
    try:
        if text:
            formula_of(text, "goal")
    except InputError as error:
        raise unfit(error.message) from None
    return text


def _limit(text: str) -> str:
    try:
        read_constraint(text)
    except InputError as error:
        raise unfit(error.message) from None
    return text


def _percent(text: str) -> str:
    try:
        read_percent(text, "quantile")
    except InputError as error:
        raise unfit(error.message) from None
    return text


_ABOUT = [quantity.about for quantity in QUANTITIES.values()]
_NAMES = {"enum": [*QUANTITIES], "enumDescriptions": _ABOUT}
_EXPRESSION = {"type": "string", "pattern": r"[-+*/(]", "examples": ["forward_speed/power"]}
Goal = Annotated[str, AfterValidator(_goal), WithJsonSchema({"anyOf": [_NAMES, _EXPRESSION]})]
LimitText = Annotated[
    Text,
    AfterValidator(_limit),
    WithJsonSchema(
        {"type": "string", "examples": ["torque <= 0.5 N m", "torque <= 0.5 N m @ 90 %", "motor 0.89 N m, 22 rad/s"]}
    ),
]
PercentText = Annotated[Text, AfterValidator(_percent), WithJsonSchema({"type": "string", "examples": ["10 %"]})]


class ProblemDescription(Described):
    """A design problem: what of a robot may vary, and what is made as large or small as possible."""

    about: str = ""
    """What the problem is and where its numbers come from, in sentences."""
    vary: RangesText
    """Quantities of the robot, by path or alias, each with a range, in steps where it has a step, or a list of choices;
    of a mission its numbers, as `swim.until`."""
    maximise: Goal = ""
    """Quantity of the motion, or expression of several, made as large as possible; speed, where nothing is said."""
    minimise: Goal = ""
    """Quantity of the motion, or expression of several, made as small as possible, instead of one to maximise."""
    keep: tuple[LimitText, ...] = ()
    """Limits that the motion keeps: a quantity, <= or >= and a value, or a motor by stall torque and no-load speed;
    of a robot with servos `voltage_demand <= 1` too, unless another limit on it stands here. `@ 90 %` behind one: it is
    kept with that probability."""
    quantile: PercentText | None = None
    """Quantile of what is maximised or minimised, over draws of what is not known exactly of the robot, as 10 %."""
    draws: Annotated[int, Field(ge=LEAST_DRAWS, le=MOST_DRAWS)] | None = None
    """Draws of what is not known exactly, for the quantile and for limits with a probability; 16 if left out."""
    forward: Direction | None = None
    """Direction of the world along which speed and thrust count; x, where nothing is said."""
    mission: str = ""
    """A mission whose time is made as short as possible: one that ships, by name, or a file beside this one."""
    whole: bool = False
    """Every limb is solved, also where equal ones do the same."""


_SHIPPED = Path(__file__).parent / "problems"
RangeLike = str | Sequence[float]  # `LOW..HIGH` with units, or two numbers in SI


@dataclass(frozen=True)
class Problem:
    """A design problem in words, which fits any robot that has its quantities.

    - vary: names of quantities and their ranges, such as `1.4..1681MPa log`, `2..6mm:0.5mm` in steps, or two numbers
      in SI; choices and counts of parts with their values.
    - maximise, minimise: one of the two, a name of `QUANTITIES`, an expression of some such as "forward_speed/power",
      or a function of a mapping from their names to numbers in SI; the largest speed where nothing is said.
    - keep: limits that a design keeps.
    - quantile, draws: a quantile over so many draws of what is not known exactly is maximised or minimised, 0 for the
      robot as its file has it; `DRAWS` where nothing is said.
    - forward: `x`, `-x`, ... `-z` of the world, along which speed and thrust count; x where nothing is said.
    - mission: the text of a mission, whose numbers vary and whose time is made as short as possible.
    - whole: every limb is solved, as by `periodic`, also where equal ones do the same.
    """

    vary: Mapping[str, RangeLike] = field(default_factory=dict)
    maximise: Objective = ""
    minimise: Objective = ""
    keep: tuple[Constraint, ...] = ()
    forward: str = ""
    mission: str = ""
    whole: bool = False
    quantile: float = 0.0
    draws: int = 0

    def changed(
        self,
        description: RobotDescription,
        *,
        fixed: Iterable[str] = (),
        vary: Mapping[str, RangeLike] | None = None,
        maximise: Objective = "",
        minimise: Objective = "",
        keep: Iterable[str | Constraint] = (),
        forward: str = "",
        mission: str = "",
        whole: bool = False,
        quantile: float = 0.0,
        draws: int = 0,
    ) -> "Problem":
        """The problem with changes; what is left out stays.

        A range takes the place of that of the same quantity of the robot, a limit the place of those on the same
        quantity. Names in `fixed` vary no more. The text of a mission takes the place of another, or of a problem about
        a motion as a whole. Raises InputError where two names set the same quantity, and for what is no limit.
        """
        base = self if self.mission or not mission else Problem()
        names, ranges = [*fixed], dict(vary or {})
        variables = dict(base.vary)
        if not (base.mission or mission):
            each = ((f"vary {name}", paths_of(name, description)) for name in ranges)
            check_each_once(each, "vary", set_paths(names, description))
            new = {path for name in (*names, *ranges) for path in (name, *paths_of(name, description))}
            variables = {v: text for v, text in variables.items() if not new & {v, *paths_of(v, description)}}
        limits = [read_constraint(limit) if isinstance(limit, str) else limit for limit in keep]
        replaced = {limit.quantity for limit in limits}
        goal = (maximise, minimise) if maximise or minimise else (base.maximise, base.minimise)
        return Problem(
            variables | ranges,
            *goal,
            (*(limit for limit in base.keep if limit.quantity not in replaced), *limits),
            forward or base.forward,
            mission or base.mission,
            whole or base.whole,
            quantile or base.quantile,
            draws or base.draws,
        )

    def task(self, description: RobotDescription, seed: int = 1) -> DesignTask:
        """Task for a robot; `seed` is that of its draws. Raises InputError for what does not fit it."""
        return self._schedule(description) if self.mission else self.motion(description, seed)

    def motion(self, description: RobotDescription, seed: int = 1) -> MotionDesign:
        """Task about the motion of a robot. Raises InputError for what does not fit it.

        Servos follow their motion (`SERVOS_FOLLOW`), unless `keep` has another limit on their voltage.
        """
        if self.maximise and self.minimise:
            both = f"{self.maximise} to maximise and {self.minimise} to minimise"
            raise InputError(f"{both}: take one.", field="minimise")
        variables = tuple(read_variable(name, text, description, steps=True) for name, text in self.vary.items())
        goal, best = (self.minimise, "low") if self.minimise else (self.maximise or "speed", "high")
        formula_of(goal, "minimise" if self.minimise else "maximise")  # for errors that name what was given
        words = description, variables, goal, self.keep, self.forward or "x", best
        if self.quantile or any(limit.probability for limit in self.keep):
            task = RobustDesign(*words, quantile=self.quantile, draws=self.draws or DRAWS, seed=seed)
        elif self.draws:
            raise InputError(
                "they go with a quantile, or with a limit such as torque <= 0.5 N m @ 90 %.", field="draws"
            )
        else:
            task = MotionDesign(*words, self.whole)
        if not task.may_saturate or any(limit.quantity == SERVOS_FOLLOW.quantity for limit in self.keep):
            return task
        return replace(task, constraints=(*self.keep, SERVOS_FOLLOW))

    def _schedule(self, description: RobotDescription) -> ScheduleDesign:
        words = {"maximise": (self.maximise, ""), "minimise": (self.minimise, "time"), "forward": (self.forward, "")}
        for name, (value, fits) in words.items():
            if value not in ("", fits):
                raise InputError(f'"{shorten(value)}": of a mission only the time is minimised.', field=name)
        if self.whole:
            raise InputError("a mission solves every limb. Leave it out.", field="whole")
        if self.quantile or self.draws:
            raise InputError("of a mission all is taken as it stands in the file. Leave it out.", field="quantile")
        if self.keep:
            raise InputError("a mission has no limits: ranges keep its numbers in bounds.", field="keep")
        mission = parse_mission(self.mission, description)
        ranges = self.vary.items()
        return ScheduleDesign(mission, tuple(read_schedule_variable(name, text, mission) for name, text in ranges))


def load_problem(path: str | Path) -> Problem:
    """Read a problem file. Raises InputError that names file, line and field."""
    return _parse(read_text(path), str(path), Path(path).parent)


def shipped_problem(robot: str) -> Problem | None:
    """Problem that ships for a robot that ships, by name; None where there is none."""
    file = next((path for path in entries(_SHIPPED, "*.yaml") if path.stem == robot), None)
    return None if file is None else _parse(file.read_text(encoding="utf-8"), file.name, Path())


def problem_of(robot: str | Path) -> Problem:
    """Problem of a robot: in ROBOT.design.yaml beside its file, else the one that ships; without both an empty one.

    Raises InputError where the file cannot be read.
    """
    path = Path(robot)
    beside = path.with_suffix(".design.yaml")
    if path.suffix in (".yaml", ".yml") and is_file(beside):
        return load_problem(beside)
    return shipped_problem(str(robot)) or Problem()


def _parse(text: str, source: str, folder: Path) -> Problem:
    data, lines = read_yaml(text, source)
    given = validate_as(ProblemDescription, data, "problem", file=source, lines=lines)
    mission = ""
    if given.mission:
        with errors_at(source, lines, "mission"):
            mission = read_text(mission_of(given.mission) or folder / given.mission)
    keep = tuple(map(read_constraint, given.keep))
    quantile = read_percent(given.quantile, "quantile") if given.quantile else 0.0
    goal = given.maximise, given.minimise
    forward = given.forward or ""
    return Problem(given.vary, *goal, keep, forward, mission, given.whole, quantile, given.draws or 0)

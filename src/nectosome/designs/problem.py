"""Problem files: what may vary, what is wanted and what must be kept, in the words that a person writes."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

from nectosome.description import RobotDescription, apply_settings, dump_robot, parse_robot, resolve
from nectosome.description.mission import parse_mission
from nectosome.description.schedule import read_schedule_variable
from nectosome.description.variables import read_variable
from nectosome.io.yaml_text import Key, read_text, read_yaml
from nectosome.robots import mission_of
from nectosome.units import InputError, did_you_mean, shorten

from .constraints import read_constraint
from .motion import MotionDesign, Varied
from .schedule import ScheduleDesign


@dataclass(frozen=True)
class Problem:
    """A design problem in words; `variables` maps names to ranges such as `1.4 MPa .. 1681 MPa log`.

    With the text of a `mission` they are numbers of it, and its time is what counts; else they are the robot's, and
    where nothing is said of them its speed counts, along x.
    """

    variables: Mapping[str, str] = field(default_factory=dict)
    objective: str = ""
    constraints: tuple[str, ...] = ()
    forward: str = ""
    mission: str = ""

    def task(self, description: RobotDescription) -> Varied:
        """Task for a robot. Raises InputError for what does not fit it."""
        return self._schedule(description) if self.mission else self.motion(description)

    def motion(self, description: RobotDescription) -> MotionDesign:
        """Task about the motion of a robot. Raises InputError for what does not fit it."""
        variables = tuple(read_variable(name, text, description) for name, text in self.variables.items())
        constraints = tuple(read_constraint(text) for text in self.constraints)
        return MotionDesign(description, variables, self.objective or "speed", constraints, self.forward or "x")

    def _schedule(self, description: RobotDescription) -> ScheduleDesign:
        asked = {"objective": (self.objective, ("", "time")), "forward": (self.forward, ("",))}
        for name, (value, fits) in asked.items():
            if value not in fits:
                raise InputError(f'"{shorten(value)}" is nothing that counts of a mission: its time does.', field=name)
        if self.constraints:
            raise InputError("a mission has no constraints: ranges keep its numbers in bounds.", field="constraint")
        mission = parse_mission(self.mission, description)
        ranges = self.variables.items()
        return ScheduleDesign(mission, tuple(read_schedule_variable(name, text, mission) for name, text in ranges))


def load_problem(path: str | Path) -> Problem:
    """Read a problem file. Raises InputError that names file, line and field."""
    return _parse(read_text(path), str(path), Path(path).parent)


def shipped_problem(robot: str) -> Problem | None:
    """Problem that ships for a robot that ships, by name; None where there is none."""
    known = {path.name for path in files("nectosome.designs").joinpath("problems").iterdir()}
    if f"{robot}.yaml" not in known:
        return None
    text = files("nectosome.designs").joinpath("problems", f"{robot}.yaml").read_text(encoding="utf-8")
    return _parse(text, f"{robot}.yaml", Path())


def change(
    description: RobotDescription,
    problem: Problem,
    fixed: tuple[str, ...] = (),
    vary: tuple[str, ...] = (),
    constraints: tuple[str, ...] = (),
    objective: str | None = None,
    forward: str | None = None,
    mission: str | None = None,
) -> tuple[RobotDescription, Problem]:
    """Robot and problem with changes: `PATH=VALUE` fixed, `PATH=RANGE` varied, constraints and objective replaced.

    A constraint takes the place of those on the same quantity; what is fixed varies no more. The text of a `mission`
    takes the place of another, or of a problem about a motion as a whole. Raises InputError.
    """
    description = apply_settings(description, fixed)
    if mission is not None:
        problem = replace(problem, mission=mission) if problem.mission else Problem(mission=mission)
    variables = dict(problem.variables)
    for text in vary:
        name, equals, span = text.partition("=")
        if not equals:
            raise InputError(
                f'"{shorten(text)}" is no range of a quantity. Write PATH=LOW..HIGH with units.', field="vary"
            )
        if not problem.mission:
            variables = _without(variables, name.strip(), description)
        variables[name.strip()] = span.strip()
    if not problem.mission:
        _check_each_once(vary, fixed, description)
    for text in fixed if not problem.mission else ():
        variables = _without(variables, text.partition("=")[0].strip(), description)
    new = [read_constraint(text) for text in constraints]
    replaced = {c.quantity for c in new}
    kept = [text for text in problem.constraints if read_constraint(text).quantity not in replaced]
    return description, Problem(
        variables,
        objective or problem.objective,
        (*kept, *map(str, new)),
        forward or problem.forward,
        problem.mission,
    )


def dump_design(description: RobotDescription, problem: Problem) -> dict[str, Any]:
    """Robot and problem as JSON data, for the folder of a run."""
    return {"robot": dump_robot(description), "problem": asdict(problem)}


def restore_design(about: Mapping[str, Any], source: str) -> tuple[RobotDescription, Problem]:
    """Robot and problem that `dump_design` stored. Raises InputError where they are not there."""
    try:
        robot, p = about["robot"], about["problem"]
        variables = {str(name): str(span) for name, span in p["variables"].items()}
        words = str(p["objective"]), tuple(map(str, p["constraints"])), str(p["forward"]), str(p.get("mission", ""))
        problem = Problem(variables, *words)
    except (KeyError, TypeError, AttributeError):
        raise InputError("holds no robot and problem that can be read.", file=source) from None
    return parse_robot(str(robot), f"{source}, its robot"), problem


def _without(variables: Mapping[str, str], name: str, description: RobotDescription) -> dict[str, str]:
    paths = set(resolve(description, name)) if _is_quantity(name, description) else set()
    return {v: text for v, text in variables.items() if not paths & set(resolve(description, v))}


def _check_each_once(vary: tuple[str, ...], fixed: tuple[str, ...], description: RobotDescription) -> None:
    """Raise InputError where what was asked for sets a quantity twice, so that one of both would be ignored."""
    asked: dict[str, str] = {}
    for option, texts in (("fix", fixed), ("vary", vary)):
        for text in texts:
            name = text.partition("=")[0].strip()
            for path in resolve(description, name) if _is_quantity(name, description) else ():
                if option == "vary" and path in asked:
                    both = f"{asked[path]} and --vary {name}"
                    raise InputError(f"{both} both set {path}. Take one of them.", field="vary")
                asked[path] = f"--{option} {name}"


def _is_quantity(name: str, description: RobotDescription) -> bool:
    try:
        resolve(description, name)
    except InputError:
        return False
    return True


def _parse(text: str, source: str, folder: Path) -> Problem:
    data, lines = read_yaml(text, source)
    if not isinstance(data, dict):
        raise InputError("is no problem file: it has no named fields.", file=source)

    def wrong(key: object, message: str) -> InputError:
        at: Key = (str(key),)
        return InputError(message, file=source, line=lines.get(at), field=shorten(key))

    known = ("about", "variables", "objective", "constraints", "forward", "mission")
    for key in data:
        if key not in known:
            raise wrong(key, f"is not known here.{did_you_mean(str(key), known)}")
    variables, constraints = data.get("variables", {}), data.get("constraints", [])
    if not isinstance(variables, dict) or not variables:
        raise wrong("variables", "needs at least one name with a range.")
    if not isinstance(constraints, list):
        raise wrong("constraints", "must be a list.")
    words = (str(data.get("objective", "")), tuple(map(str, constraints)), str(data.get("forward", "")))
    mission = ""
    if "mission" in data:
        name = str(data["mission"])
        try:
            mission = read_text(mission_of(name) or folder / name)
        except InputError as error:
            raise wrong("mission", str(error)) from None
    return Problem({str(name): str(span) for name, span in variables.items()}, *words, mission)

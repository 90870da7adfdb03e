"""`nectosome design`: the numbers of a robot with which its motion is best, or its mission shortest."""

import functools
import math
import time as clock
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import App, Parameter

from nectosome.cli import options
from nectosome.cli.options import Cluster, Part, build_weighed, command, goes_on, on_cluster, robot_named
from nectosome.cli.output import Data, Json, check_target, tell, write
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import save_dataset, write_atomic
from nectosome.io.file_system import entries, exists
from nectosome.io.summary import Summary
from nectosome.io.tables import Number, Table, number
from nectosome.units import (
    DIMENSIONS,
    InputError,
    count,
    read_pairs,
    read_positive,
    read_quantity,
    show_quantity,
    shown_unit,
)
from nectosome.units.zero import counts_as_zero

if TYPE_CHECKING:
    from nectosome.designs import DesignResult, DesignTask
    from nectosome.search import Evaluation, Result

_KEPT = ("search.json", "start_*.jsonl", "best.yaml", "evaluations.nc")  # files of a run


design = command(App(name="design", help="Find the numbers of a robot that are best for its motion, or its materials."))


@design.default
def design_robot(
    robot: options.Robot,
    /,
    *,
    vary: options.Vary = None,
    maximise: Annotated[
        str | None, Parameter(help="speed, thrust, forward_speed/power, ...; speed unless given.")
    ] = None,
    minimise: Annotated[str | None, Parameter(help="power, torque, cost_of_transport, ... instead.")] = None,
    keep: Annotated[
        list[str] | None,
        Parameter(
            help='A limit, "torque <= 0.4 N m", or with a probability, "torque <= 0.4 N m @ 90 %"; may be repeated.'
        ),
    ] = None,
    quantile: Annotated[
        str | None,
        options.value("10%: what is maximised or minimised is this quantile over draws of what is not known exactly."),
    ] = None,
    draws: Annotated[
        int | None,
        options.whole(
            "Draws for --quantile and for limits with a probability, 16 by default; of --spread, 40.",
            8,
            10_000,
            "--draws",
        ),
    ] = None,
    spread: Annotated[bool, Parameter(help="Print the interval of every number of the best design, too.")] = False,
    forward: Annotated[str | None, options.value("x, -x, ... -z: along which speed counts.")] = None,
    settings: options.Settings = None,
    mission: Annotated[
        Path | None, Parameter(help="Make this mission as short as possible: a file, or a robot that ships.")
    ] = None,
    problem: Annotated[
        Path | None, Parameter(help="Problem file; ROBOT.design.yaml beside the robot by default.")
    ] = None,
    every_limb: options.Whole = False,
    optimiser: Annotated[
        str | None,
        Parameter(help="gradient, pattern, cmaes, genetic or differential; gradient by default, cmaes for a mission."),
    ] = None,
    starts: Annotated[int, options.starts(100_000)] = options.STARTS,
    own_first: Annotated[bool, Parameter(help="Begin the first start with the numbers of the file.")] = False,
    seed: options.Seed = options.SEED,
    cluster: Cluster = None,
    part: Part = None,
    out: Annotated[
        Path | None,
        Parameter(
            help="Folder of all results, with the best design so far; the same command again continues there, --force "
            "starts anew."
        ),
    ] = None,
    found: options.WriteRobot = None,
    data: Data = Data(),
) -> int:
    """Find the numbers of a robot that maximise or minimise a quantity of its motion, within ranges and limits."""
    ranges = read_pairs(vary, "--vary", "limbs.fin.length=50..90mm")
    _check_part(part, out)
    data.check()
    check_target(found, "--write", ".yaml", data.force)
    if spread and (mission is not None or part is not None):
        raise InputError(f"is not for a {'mission' if mission else 'share'}. Leave it out.", field="--spread")

    from nectosome import designs

    build_weighed(robot_named(robot, settings), robot)
    began = clock.perf_counter()
    with progress_bar(f"{robot}, {starts} starts") as update, _anew(out if data.force else None):
        given = functools.partial(
            designs.design,
            robot,
            settings or (),
            problem=problem,
            vary=ranges,
            maximise=maximise or "",
            minimise=minimise or "",
            keep=keep or (),
            quantile=quantile or 0.0,
            draws=0 if spread and not quantile and not any("@" in one for one in keep or ()) else draws or 0,
            forward=forward or "",
            mission=mission or "",
            whole=every_limb,
            optimiser=optimiser,
            starts=starts,
            seed=seed,
            own_first=own_first,
            folder=out,
            share=part or "1/1",
        )
        try:
            result = on_cluster(
                cluster,
                lambda executor: cancellable(lambda progress: given(progress=progress, executor=executor), update),
                out,
            )
        except RuntimeError as error:
            tell(f"{robot}: {error}")
            return 1
    if result is None:
        return 1
    if result.cancelled:
        tell(f"cancelled.{goes_on(out)}")
    code = _show(result, clock.perf_counter() - began, spread, draws, seed)
    if not result.search.starts:
        return code
    evaluations, files = result.to_dataset(), list[Path]()
    if out is not None:
        files.append(out / "evaluations.nc")
        save_dataset(evaluations, files[-1])
    if result.best is not None:
        if out is not None:
            files.append(out / designs.BEST)
        if found is not None:
            files.append(found)
            write_atomic(found, result.text.encode())
    data.write(evaluations, None, *files)
    return code


@contextmanager
def _anew(out: Path | None) -> Iterator[None]:
    """Take away the files of an earlier run; a command that is refused before it has any leaves them as they were."""
    patterns = () if out is None else (*_KEPT, *(f"choice_*/{kept}" for kept in _KEPT))
    old = {path: path.with_name(f"old-{path.name}") for pattern in patterns for path in entries(out or "", pattern)}
    for path, aside in old.items():
        path.replace(aside)
    begun = True
    try:
        yield
    except InputError:
        begun = any(map(exists, old))
        raise
    finally:
        for path, aside in old.items():
            if begun:
                aside.unlink(missing_ok=True)
            else:
                aside.replace(path)


@design.command
def composite(
    *,
    core: Annotated[str, options.value("Young's modulus of the core, such as 17MPa.")],
    shell: Annotated[str, options.value("Young's modulus of the shell around it, such as 592kPa.")],
    young: Annotated[str | None, options.value("Young's modulus that is wanted: the core's size is found.")] = None,
    ratio: Annotated[str | None, options.value("Core's size, 0 to 1 of the whole: Young's modulus is found.")] = None,
    as_json: Json = False,
) -> None:
    """Find the core of a soft rod that gives it a wanted Young's modulus in bending, or what a core gives.

    Core and rod have one shape and one cone angle. EJ adds bending stiffnesses; EJV weighs them by volumes too.
    """
    from nectosome.designs.composite import RULES, ratio_of, young_of

    if (young is None) == (ratio is None):
        raise InputError("takes --young or --ratio: one of the two.", field="composite")
    materials = read_positive(core, "pressure", "--core"), read_positive(shell, "pressure", "--shell")
    rows = list[tuple[str | Number, ...]]()
    for rule in RULES:
        if young is None:
            beta = read_quantity(ratio or "", "number", "--ratio")
            modulus = young_of(beta, *materials, rule)
        else:
            modulus = read_positive(young, "pressure", "--young")
            beta = ratio_of(modulus, *materials, rule)
        rows.append((rule, Number(beta), Number(modulus, "Pa", shown=show_quantity(modulus, "pressure"))))
    heads = {"rule": "rule", "ratio": "core's radius / whole", "young": "Young's modulus"}
    note = "EJ is exact for sections that stay plane; EJV is the rule of mixtures as Armanini et al. print it (eq. 9)"
    write(Summary("composite", [Table("rules", heads, rows)], notes=[note]))


def _check_part(part: str | None, out: Path | None) -> None:
    """Raise InputError for a share that is none, or has no folder."""
    if part is None:
        return
    from nectosome.search.search_folder import read_share

    read_share(part, "--part")
    if out is None:
        raise InputError("needs a folder for the share, as in --out share-1.", field="--part")


def _intervals(result: "DesignResult", draws: int | None, seed: int) -> list[Summary]:
    """Every number of the best design with its interval."""
    from nectosome.cli.spread import intervals_summary
    from nectosome.description import parse_robot
    from nectosome.designs.uncertain_runs import spread
    from nectosome.model import build
    from nectosome.solve import find_symmetry

    robot, began = parse_robot(result.text, "the best design"), clock.perf_counter()
    verb = "steady" if find_symmetry(build(robot)).steady else "periodic"
    try:
        with progress_bar(f"{robot.name}: intervals of the best design") as update:
            found = cancellable(lambda progress: spread(robot, verb, draws=draws, seed=seed, progress=progress), update)
    except InputError as error:  # what was found stays found
        tell(f"{robot.name}: no intervals: {error.message}")
        return []
    return [] if found is None else [intervals_summary(found, clock.perf_counter() - began)]


def _show(result: "DesignResult", seconds: float, spread: bool = False, draws: int | None = None, seed: int = 1) -> int:
    task, search = result.task, result.search
    designs = [start.best for start in search.best(5) if start.best is not None]
    if not designs:
        if result.cancelled:
            tell(f"{task.description.name}: no design so far keeps all limits.")
            return 130
        every = [start for one in result.choices or (result,) for start in one.search.starts]
        why = "; ".join(dict.fromkeys(start.message for start in every)) or "nothing was evaluated"
        tell(" ".join([f"{task.description.name}: no design keeps all limits: {why}.", *_added(result)]))
        return 1
    heads = {"design": "design"} | {name: name.replace("_", " ") for name in (*task.names, *task.units)}
    rows = list[tuple[str | Number, ...]]()
    for k, one in enumerate(designs, start=1):
        rows.append((str(k), *_values(task, one), *_outputs(task, search, one)))
    best = designs[0]
    active = [name for name, g in zip(task.constraint_names, best.constraints, strict=True) if g > -1e-4]
    refused = sum(sum(start.rejected.values()) for start in search.starts)
    notes = [
        f"{count(len(search.starts), 'start')}, {refused} drawn designs refused, {search.evaluations} evaluations, "
        f"{seconds:.1f} s; {100 * search.share():.0f} % of the starts within 1 % of the best",
        f"at its limit: {', '.join(active) or 'nothing'}",
        *_added(result),
        *_by_one_limb(task),
        *_drawn(task, best),
        *(f"began at an end of its range, the file's own value is outside: {name}" for name in result.outside),
        *_at_an_end(task, best),
        *_saturated(best),
    ]
    values = {"starts": Number(len(search.starts)), "refused": Number(refused), "share": Number(search.share())}
    values |= {"evaluations": Number(search.evaluations), "seconds": Number(seconds, "s")}
    so_far = " so far" if result.cancelled else ""
    title = f"{task.description.name}: best designs{so_far}{f' with {result.choice}' if result.choice else ''}"
    tables = [Table("designs", heads, rows, listed=True, apart=True), *_choices(result)]
    parts = _intervals(result, draws, seed) if spread and not result.cancelled else []
    write(Summary(title, tables, notes=notes, values=values, parts=parts))
    if result.cancelled:
        return 130
    if not all(start.converged for start in search.starts):
        tell(_stopped(search))
    return 0


def _added(result: "DesignResult") -> list[str]:
    """A line with the limits that nobody named; none where there are none."""
    return [f"Kept besides, since the robot has servos: {name} (--keep changes it)." for name in result.added]


def _by_one_limb(task: "DesignTask") -> list[str]:
    """A line where one of several equal limbs was solved for all of them."""
    from nectosome.designs.motion import MotionDesign
    from nectosome.solve.equal_limbs import EQUAL_LIMBS, with_equal_limbs

    limbs = task.equal_limbs() if isinstance(task, MotionDesign) else 1
    return [with_equal_limbs("solved", {EQUAL_LIMBS: limbs})] if limbs > 1 else []


def _drawn(task: "DesignTask", best: "Evaluation") -> list[str]:
    """Lines that say what the draws of what is not known exactly are; none without them."""
    from nectosome.designs.constraints import percent
    from nectosome.designs.robust import LOST, UNSURE, RobustDesign, shares_between

    if not isinstance(task, RobustDesign):
        return []
    lost = int(best.outputs[LOST])
    worst = [f"{lost} of the draws have no motion: they count as worse than all others"] if lost else []
    what = f"over {task.draws} draws of what is not known exactly (seed {task.seed})"
    shares = dict.fromkeys(filter(None, (task.quantile, *(c.probability for c in task.constraints))))
    ends = {share: shares_between(share, task.draws) for share in shares}
    each = (f"{percent(share)} may be {100 * a:.0f} to {100 * b:.0f} %" for share, (a, b) in ends.items())
    sure = (
        f"so many draws leave a quantile unsure, by one standard error: {', '.join(each)}; more --draws make it surer"
    )
    error = best.outputs.get(UNSURE, math.nan)
    objective = task.units[task.objective_name].removesuffix("1")
    own = [f"standard error of the {percent(task.quantile)} quantile: {number(error)} {objective}".rstrip()]
    return [
        f"quantiles and limits with @ are {what}; all else is of the design itself", *worst, sure,
        *(own if math.isfinite(error) else []),
    ]  # fmt: skip


def _saturated(best: "Evaluation") -> list[str]:
    """A line where a servo of a design cannot do what its motion asks for."""
    if best.outputs.get("voltage_demand", 0.0) <= 1:
        return []
    return ["a servo asks for more than its full voltage: leave --keep voltage_demand out, and it follows its motion"]


def _choices(result: "DesignResult") -> list[Table]:
    """The best design of each choice; nothing without choices."""
    if not result.choices:
        return []
    names = [*result.task.names, *result.task.units]
    rows = list[tuple[str | Number, ...]]()
    for one in result.choices:
        if one.best is None:
            rows.append((one.choice, "no design keeps all limits"))
            continue
        rows.append((one.choice, *_values(one.task, one.best), *_outputs(one.task, one.search, one.best)))
    heads = {"choice": "choice"} | {name: name.replace("_", " ") for name in names}
    return [Table("choices", heads, rows, apart=True)]


def _stopped(search: "Result") -> str:
    """How many starts stopped before they reached an optimum, why, and what that means for the best design."""
    stopped = [start for start in search.starts if not start.converged]
    why = "; ".join(dict.fromkeys(start.message for start in stopped))
    said = f"{len(stopped)} of {count(len(search.starts), 'start')} stopped before an optimum was reached: {why}."
    if search.best()[0].converged:
        return f"{said} The best design is of a start that reached one."
    return (
        f"{said} The best design is of such a start, and a better one may be near: "
        "run it with more --starts, or with narrower ranges around that design."
    )


def _values(task: "DesignTask", e: "Evaluation") -> list[Number]:
    """The variables of a design."""
    each = zip(task.variables, map(float, task.box.values(e.u)), strict=True)
    return [Number(x, DIMENSIONS[v.dimension].unit, shown=show_quantity(x, v.dimension)) for v, x in each]


def _outputs(task: "DesignTask", search: "Result", e: "Evaluation") -> list[Number]:
    """The quantities of a design: 0 where rounding against the largest of all evaluations, angles in degrees."""
    found, every = list[Number](), [one for start in search.starts for one in start.evaluations]
    for name, unit in task.units.items():
        value = float(e.outputs[name])
        others = (abs(one.outputs.get(name, 0.0)) for one in every)
        zero = counts_as_zero(value, max(filter(math.isfinite, others), default=0.0))
        factor, shown = shown_unit(unit.removesuffix("1"))
        text = "" if math.isnan(value) else f"{number(0.0 if zero else factor * value)} {shown}".strip()
        found.append(Number(value, unit.removesuffix("1"), shown=text))
    return found


def _at_an_end(task: "DesignTask", e: "Evaluation") -> list[str]:
    """A line that names the variables that a wider range may make better; none where there are none."""
    ends, each = task.at_an_end(e.u), zip(task.variables, _values(task, e), strict=True)
    there = [f"{v.name} ({value.shown})" for v, value in each if v in ends]
    return [f"at an end of its range: {', '.join(there)}: widen it if the robot allows"] if there else []

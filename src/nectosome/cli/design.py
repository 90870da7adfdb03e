"""`nectosome design`: the numbers of a robot that make its motion as good as it gets, or its mission as short."""

import time as clock
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from cyclopts import Parameter
from rich.table import Table

from nectosome.cli.output import tell, write
from nectosome.cli.progress import progress_bar
from nectosome.cli.weights import weigh
from nectosome.io import save_dataset, write_atomic
from nectosome.io.yaml_text import read_text
from nectosome.units import InputError, shorten, show_quantity

if TYPE_CHECKING:
    from nectosome.designs import Varied
    from nectosome.search import Evaluation, Result


def design(
    robot: Annotated[str | None, Parameter(help="Name of a robot that ships, or a robot file.")] = None,
    /,
    *,
    solver: Annotated[
        Literal["gradient", "pattern", "cmaes"] | None,
        Parameter(help="How each start is improved; gradient by default, cmaes for a mission."),
    ] = None,
    starts: Annotated[
        str | None,
        Parameter(help="How many starts, drawn at random; 12 by default, 2 of a mission.", allow_leading_hyphen=True),
    ] = None,
    seed: Annotated[str | None, Parameter(help="Of the random draws; 1 by default.", allow_leading_hyphen=True)] = None,
    objective: Annotated[str | None, Parameter(help="speed, efficiency, cost_of_transport, power, ...")] = None,
    vary: Annotated[
        list[str] | None,
        Parameter(
            "--vary", help='"PATH=LOW .. HIGH [log]": may vary; in a mission MODE.PATH or MODE.until; repeatable.'
        ),
    ] = None,
    fix: Annotated[list[str] | None, Parameter("--fix", help="PATH=VALUE: stays; may be repeated.")] = None,
    constraint: Annotated[
        list[str] | None, Parameter("--constraint", help='"torque <= 0.4 N m"; may be repeated.')
    ] = None,
    forward: Annotated[
        str | None, Parameter(help="x, -x, ... -z: where speed counts.", allow_leading_hyphen=True)
    ] = None,
    mission: Annotated[
        Path | None, Parameter(help="Make this mission as short as it gets: a mission file, or a robot that ships.")
    ] = None,
    problem: Annotated[
        Path | None, Parameter(help="Problem file; ROBOT.design.yaml beside the robot by default.")
    ] = None,
    out: Annotated[Path | None, Parameter(help="Folder of the run; a run that was stopped there goes on.")] = None,
    resume: Annotated[Path | None, Parameter(help="Go on with the run in this folder; --starts may add some.")] = None,
) -> int:
    """Optimise the design of a robot from many starts; the run can be stopped at any time and goes on where it was."""
    if (robot is None) == (resume is None):
        raise InputError("name a robot, or the folder of a run with --resume.", field="design")
    number = None if starts is None else _whole(starts, "--starts", 1, 100_000)
    seeded = 1 if seed is None else _whole(seed, "--seed", 0, 2**31 - 1)
    settled = (solver, seed, objective, vary, fix, constraint, forward, mission, problem, out)
    if resume is not None and any(option is not None for option in settled):
        raise InputError(
            "what the run in that folder was asked is settled; only --starts may go with it.", field="--resume"
        )

    from nectosome import designs, model, robots, search

    if resume is not None:
        held = search.read_search(resume)
        description, wanted = designs.restore_design(held["about"], str(resume))
        options = dict(held["optimiser"])
        chosen = search.make_optimiser(options.pop("name"), **options)
        number, seeded, folder = number or held["starts"], held["seed"], resume
    else:
        assert robot is not None
        base = robots.describe(robot)
        description, wanted = designs.change(
            base,
            _problem(robot, problem, vary),
            tuple(fix or ()),
            tuple(vary or ()),
            tuple(constraint or ()),
            objective,
            forward,
            None if mission is None else read_text(robots.mission_of(str(mission)) or mission),
        )
        solver = solver or ("cmaes" if wanted.mission else "gradient")
        if wanted.mission and solver == "gradient":
            raise InputError("a mission has no derivatives. Take cmaes or pattern.", field="--solver")
        chosen, number = search.make_optimiser(solver), number or (2 if wanted.mission else 12)
        folder = out or Path("out") / f"design-{description.name}-{solver}-{seeded}"
    task = wanted.task(description)
    weigh(model.build(description), robot or str(resume))
    task.prepare()  # mistakes are told before anything is begun
    began = clock.perf_counter()
    with progress_bar(f"{description.name}, {number} starts") as update:

        def progress(done: int, best: "Evaluation | None", evaluations: int) -> bool:
            value = "" if best is None else f"best {task.objective} {_shown(best, task)}, "
            update(f"{value}{evaluations} evaluations", done / number)
            return True

        about = designs.dump_design(description, wanted)
        try:
            result = search.multistart(task, chosen, number, seeded, folder=folder, about=about, progress=progress)
        except KeyboardInterrupt:
            tell(f"cancelled. To go on: nectosome design --resume {folder}")
            return 130
        except RuntimeError as error:
            tell(f"{description.name}: {error}")
            return 1
    return _tell(task, result, folder, clock.perf_counter() - began)


def _whole(text: str, option: str, least: int, most: int) -> int:
    try:
        number = int(text)
    except ValueError:
        number = least - 1
    if not least <= number <= most:
        raise InputError(f'"{shorten(text)}" must be a whole number from {least} to {most}.', field=option)
    return number


def _problem(robot: str, file: Path | None, vary: list[str] | None):
    from nectosome.designs import Problem, load_problem, shipped_problem

    beside = Path(robot).with_suffix(".design.yaml") if robot.endswith((".yaml", ".yml")) else None
    if file is not None:
        return load_problem(file)
    if beside is not None and beside.is_file():
        return load_problem(beside)
    found = shipped_problem(robot)
    if found is None and not vary:
        raise InputError(
            f'nothing is said about what may vary. Write --vary "PATH=LOW .. HIGH", or a problem file for {robot}.'
        )
    return found or Problem()


def _shown(e: "Evaluation", task: "Varied") -> str:
    return f"{e.outputs[task.objective]:.4g} {task.told[task.objective]}"


def _tell(task: "Varied", result: "Result", folder: Path, seconds: float) -> int:
    chosen = [start for start in result.best(5) if start.best is not None]
    if result.starts:
        save_dataset(result.to_dataset(), folder / "evaluations.nc")
    if not chosen:
        why = "; ".join(dict.fromkeys(start.message for start in result.starts)) or "nothing was evaluated"
        tell(f"{task.description.name}: no design keeps all limits: {why}.")
        return 1
    table = Table(header_style="bold", title="best designs", title_justify="left")
    for name in (*task.names, *(f"{name} ({unit})" for name, unit in task.told.items())):
        table.add_column(name, justify="right")
    for start in chosen:
        assert start.best is not None
        table.add_row(*_values(task, start.best), *(f"{start.best.outputs[name]:.4g}" for name in task.told))
    best = chosen[0].best
    assert best is not None
    write_atomic(folder / "best.yaml", task.chosen(best.u).encode())
    active = [name for name, g in zip(task.constraint_names, best.constraints, strict=True) if g > -1e-4]
    counted = sum(len(start.evaluations) for start in result.starts)
    refused = sum(sum(start.rejected.values()) for start in result.starts)
    write(
        table,
        f"{len(result.starts)} starts, {refused} drawn designs refused, {counted} evaluations, {seconds:.1f} s; "
        f"{100 * result.share():.0f} % of the starts within 1 % of the best",
        f"at its limit: {', '.join(active) or 'nothing'}",
        *_at_an_end(task, best),
        f"best design: {folder / 'best.yaml'}; all evaluations: {folder / 'evaluations.nc'}",
        wrap=False,
    )
    unfinished = sum(not start.converged for start in result.starts)
    if unfinished:
        tell(f"{unfinished} of {len(result.starts)} starts ended before they converged; their best designs count.")
    return 0


def _values(task: "Varied", e: "Evaluation") -> list[str]:
    """The variables of a design in words."""
    return [show_quantity(float(x), v.dimension) for v, x in zip(task.variables, task.box.values(e.u), strict=True)]


def _at_an_end(task: "Varied", e: "Evaluation") -> list[str]:
    """A line that names the variables that a wider range may make better; none where there are none."""
    ends = task.at_an_end(e.u)
    each = zip(task.variables, _values(task, e), strict=True)
    there = [f"{v.name} ({value})" for v, value in each if v in ends]
    return [f"at an end of its range: {', '.join(there)}: widen it if the robot allows"] if there else []

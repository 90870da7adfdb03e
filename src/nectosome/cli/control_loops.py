"""`nectosome control loops ROBOT FILE`: several controllers of a robot at once, rehearsed on its model, on a rig."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from cyclopts import Parameter

from nectosome.cli.control_on_rig import OWN_RIG, conclude, loop_notes, named, run_and_save, sampling_note
from nectosome.cli.control_rig import names_of_runs
from nectosome.cli.loop_errors import errors_on_rig, rounds_on_rig
from nectosome.cli.options import Robot, Settings
from nectosome.cli.output import Outputs, tell
from nectosome.cli.page import Summary
from nectosome.cli.progress import cancellable, progress_bar
from nectosome.io import provenance
from nectosome.units import count

if TYPE_CHECKING:
    from nectosome.controllers import ControlTask, FoundController
    from nectosome.rigs.loops_file import LoopsFile


def control_loops(
    robot: Robot,
    file: Annotated[Path, Parameter(help="File of loops (.yaml): command, measure and reference of each.")],
    /,
    *,
    rig: Annotated[
        Path, Parameter(help="Rig on which to run them: a rig file (.yaml), or simulated, the robot itself.")
    ] = Path("simulated"),
    settings: Settings = None,
    outputs: Outputs = Outputs(),
) -> int:
    """Run several controllers of a robot at once on a rig, after a rehearsal on the model.

    Controllers are found on the model, loop by loop, with the other commands at their initial values. Then
    all loops are rehearsed together, under the guards of the rig.
    """
    outputs.check()

    from nectosome.rigs.files import load_rig
    from nectosome.rigs.loops_file import load_loops
    from nectosome.rigs.robot_bench import check_pair
    from nectosome.rigs.robot_loops import SIMULATED, bench_of_loops, own_rig

    loops = load_loops(file)
    on = None if str(rig) == SIMULATED else load_rig(rig)
    pairs = None if on is None else loops.pairs(on.rig)
    with progress_bar(Path(robot).stem) as update:
        tasks = loops.tasks(robot, settings or (), None if on is None else on.dt)
        seconds = loops.seconds(tasks)
        if on is None or pairs is None:
            used, limits, own = own_rig([*tasks.values()], seconds)
            pairs = dict(zip(tasks, own, strict=True))
        else:
            used, limits = on.rig, on.limits
        for name, task in tasks.items():
            with loops.errors_of(name):
                check_pair(task, used, limits, pairs[name])
        slews = {name: limits.commands[pair.command].slew for name, pair in pairs.items()}
        laws = cancellable(lambda progress: _laws(loops, tasks, seconds, slews, progress), update)
        if laws is None:
            tell("cancelled while the controllers were found.")
            return 130
        rounds = max(task.rounds for task in tasks.values())
        saved = names_of_runs(outputs, rounds)
        bench = bench_of_loops([*tasks.values()], [*laws.values()], seconds, used, limits, [*pairs.values()])
        rehearsed = bench.rehearse(rounds, named("rehearsing", update))
    runs = run_and_save(bench, saved, rounds)
    run = runs[-1]
    last = {"model": rehearsed[-1], "rig": run.data}
    every = {"model": rehearsed, "rig": [one.data for one in runs]}
    tables = [errors_on_rig(name, task, pairs[name].measurement, last) for name, task in tasks.items()]
    for name, task in tasks.items():
        learned = rounds_on_rig(f"rounds {name}", task, pairs[name].measurement, every)
        tables += [] if learned is None else [learned]
    notes = [
        f"{name}, {words}"
        for name, task in tasks.items()
        for words in loop_notes(task, laws[name], pairs[name].command, run.data)
    ]
    notes.append(sampling_note(run.data))
    notes += [OWN_RIG] if on is None else []
    given = loops.given.model_dump(mode="json", exclude_none=True, exclude={"about"})
    given |= {"robot": robot, "set": settings or [], "rig": str(rig), "time": seconds}
    given |= {"gains": {name: task.gains_text(laws[name].gains) for name, task in tasks.items()}}
    attributes = {"status": run.status, "status_reason": run.reason, "provenance": json.dumps(provenance(given))}
    title = f"{next(iter(tasks.values())).robot.description.name}: {count(len(tasks), 'loop')} on {used.name}"
    title += f": {run.status}, {run.data.sizes['time']} samples"
    return conclude(Summary(title, tables, notes=notes, attributes=attributes), rehearsed[-1], runs, saved, outputs)


def _laws(
    loops: "LoopsFile",
    tasks: "dict[str, ControlTask]",
    seconds: float,
    slews: dict[str, float],
    progress: Callable[[str, float], bool],
) -> "dict[str, FoundController] | None":
    """The controller of each loop, found alone; None where `progress` returns False."""
    found: dict[str, FoundController] = {}
    for k, (name, task) in enumerate(tasks.items()):

        def report(what: str, share: float, k: int = k, name: str = name) -> bool:
            return progress(f"{name}, {what}", (k + share) / len(tasks))

        with loops.errors_of(name):
            law = task.find_law(seconds, report, slew=slews[name])
        if law is None:
            return None
        found[name] = law
    return found
